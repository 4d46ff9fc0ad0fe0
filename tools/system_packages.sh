#!/bin/sh
# The one list of what Photon Bake needs of a system: as root on Debian, what is missing is installed.
#   tools/system_packages.sh [PYTHON]     PYTHON looks for the libraries; without one it is missing too, and so are they
# Silent where nothing is missing; ends with status 1 and a sentence where it cannot install.
set -eu
python=${1:-}
missing=

needs_command() { command -v "$1" >/dev/null || missing="$missing $2"; }

# A library and the packages that bring it: what the bpy wheel is linked to, window or not, and what Blender 5.2 opens to
# compute on a GPU or, without one, in Mesa, as its compositor does.
libraries='
libX11.so.6 libx11-6
libXext.so.6 libxext6
libXfixes.so.3 libxfixes3
libXi.so.6 libxi6
libXrender.so.1 libxrender1
libxkbcommon.so.0 libxkbcommon0
libSM.so.6 libsm6
libICE.so.6 libice6
libGL.so.1 libgl1
libEGL.so.1 libegl1 libgl1-mesa-dri
'

needs_command make make
needs_command git git
if [ -z "$python" ]; then
  missing="$missing python3-venv $(printf %s "$libraries" | cut -s -d ' ' -f 2- | paste -s -d ' ')"
elif [ "$(uname)" = Linux ]; then
  missing=$missing$(printf %s "$libraries" | "$python" -c '
import ctypes, sys
for library, *packages in map(str.split, filter(str.strip, sys.stdin)):
    try:
        ctypes.CDLL(library)
    except OSError:
        print("", *packages, end="")
')
fi
[ -n "$missing" ] || exit 0

install="apt-get install -y --no-install-recommends$missing"
if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
  echo "Photon Bake needs packages of the system that are missing; run as root, on Debian: apt-get update && $install" >&2
  exit 1
fi
[ -n "${QUIET:-}" ] || echo "Installing with apt:$missing" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
export DEBIAN_FRONTEND=noninteractive
if ! { apt-get update && $install; } >"$log" 2>&1; then
  cat "$log" >&2
  echo "The packages could not be installed; make this work, then try again: apt-get update && $install" >&2
  exit 1
fi
