#!/bin/sh
# Takes the pictures panel_baking.png, panel_baked.png, panel_lightmaps.png and debug_views.png of a real Blender in a
# virtual display; or those that another script asks for in the same way.
#   tools/screenshot_panel.sh BLENDER [FOLDER [SCRIPT.py]]     FOLDER is docs/images unless told; PYTHON is .venv/bin/python
#   tools/screenshot_panel.sh BLENDER build/clicks tools/clicks.py       counts clicks, with a picture of each
# Needs Xvfb, and import of ImageMagick. The extension is built and installed apart from the user's settings.
set -eu
[ $# -ge 1 ] || { sed -n '2,6p' "$0" >&2; exit 2; }
blender=$1
out=${2:-docs/images}
script=${3:-tools/screenshot_panel.py}
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

"$blender" --gpu-backend opengl --window-geometry 0 0 1600 1000 --enable-event-simulate --python "$script" -- "$home" >&2 &
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
cp "$home"/*.png "$out" 2>/dev/null || true
ls "$out"/*.png
