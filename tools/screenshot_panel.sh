#!/bin/sh
# Takes docs/images/panel_baking.png and panel_baked.png of a real Blender in a virtual display.
#   tools/screenshot_panel.sh BLENDER EXTENSION.zip [FOLDER]
# Needs Xvfb and ImageMagick's import. The extension is installed into an empty, temporary home.
set -eu
[ $# -ge 2 ] || { sed -n '2,4p' "$0" >&2; exit 2; }
blender=$1 zip=$2 out=${3:-docs/images}
cd "$(dirname "$0")/.."
mkdir -p "$out"
home=$(mktemp -d)
export BLENDER_USER_RESOURCES="$home/blender" LIBGL_ALWAYS_SOFTWARE=1
cp "$zip" "$home/extension.zip"
"$blender" -b -c extension install-file -r user_default -e "$home/extension.zip" >&2

Xvfb -displayfd 3 -screen 0 1600x1000x24 -nolisten tcp 3>"$home/display" 2>/dev/null &
screen=$!
trap 'kill $screen 2>/dev/null; rm -rf "$home"' EXIT INT TERM
while [ ! -s "$home/display" ]; do sleep 0.1; done
DISPLAY=:$(cat "$home/display"); export DISPLAY

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
ls "$out"/panel_*.png
