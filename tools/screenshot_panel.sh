#!/bin/sh
# Takes the pictures panel_baking.png, panel_baked.png, panel_lightmaps.png and debug_views.png of a real Blender in a
# virtual display.
#   tools/screenshot_panel.sh BLENDER [FOLDER]          FOLDER is docs/images unless told; PYTHON is .venv/bin/python
# Needs Xvfb, and import of ImageMagick. The extension is built and installed apart from the user's settings.
set -eu
[ $# -ge 1 ] || { sed -n '2,5p' "$0" >&2; exit 2; }
blender=$1
out=${2:-docs/images}
cd "$(dirname "$0")/.."
mkdir -p "$out"
home=$(mktemp -d)
trap 'kill $screen 2>/dev/null; rm -rf "$home"' EXIT
trap 'exit 130' INT TERM
screen=
cp -r "$("${PYTHON:-.venv/bin/python}" tools/install_zip.py "$blender")" "$home/resources"

Xvfb -displayfd 3 -screen 0 1600x1000x24 -nolisten tcp 3>"$home/display" 2>/dev/null &
screen=$!
while [ ! -s "$home/display" ]; do sleep 0.1; done
DISPLAY=:$(cat "$home/display")
export DISPLAY LIBGL_ALWAYS_SOFTWARE=1 BLENDER_USER_RESOURCES="$home/resources" TMPDIR="$home"

"$blender" --gpu-backend opengl --window-geometry 0 0 1600 1000 --python tools/screenshot_panel.py -- "$home" >&2 &
shown=$!
while kill -0 $shown 2>/dev/null; do
    for ready in "$home"/*.ready; do
        [ -e "$ready" ] || continue
        import -window root "$out/$(basename "$ready" .ready).png"
        rm "$ready"
    done
    sleep 0.2
done
wait $shown
ls "$out"/panel_baking.png "$out"/panel_baked.png "$out"/panel_lightmaps.png "$out"/debug_views.png
