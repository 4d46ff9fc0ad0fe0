#!/bin/sh
# Makes or updates a virtual environment with what pyproject.toml lists, and the checkout in it as `photon_bake`.
# What the system lacks for it is installed too, as root on Debian (tools/system_packages.sh).
#   tools/setup_env.sh VENV      silent where nothing is to be done; PYTHON=… names the interpreter to use; QUIET=1
set -eu
cd "$(dirname "$0")/.."
venv=${1:-.venv}
ready=$venv/ready

say() { [ -n "${QUIET:-}" ] || echo "$@" >&2; }
version() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }
supported() { case $(version "$1") in 3.13 | 3.11) ;; *) return 1 ;; esac; }
can_make_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }
has_pip() { "$1" -c 'import venv, pip' 2>/dev/null; }
find_python() {
  # The first that can make a whole environment; else the first whose own pip can fill one.
  for how in can_make_venv has_pip; do
    for found in ${PYTHON:-python3.13 python3.11 python3 python}; do
      if supported "$found" && $how "$found"; then return; fi
    done
  done
  return 1
}
debian_has_one() { [ -z "${PYTHON:-}" ] && command -v apt-get >/dev/null && { supported python3 || ! command -v python3 >/dev/null; }; }

stamp=$(pwd; cat pyproject.toml tools/setup_env.sh tools/system_packages.sh | cksum)
if [ -x "$venv/bin/python" ] && supported "$venv/bin/python"; then
  if [ -n "${PYTHON:-}" ] && [ "$(version "$PYTHON")" != "$(version "$venv/bin/python")" ]; then
    say "$venv has another Python than $PYTHON"
    rm -rf "$venv"
  elif [ "$(cat "$ready" 2>/dev/null)" = "$stamp" ]; then
    exit 0
  fi
else
  rm -rf "$venv"
fi

if [ ! -x "$venv/bin/python" ]; then
  find_python || { debian_has_one && sh tools/system_packages.sh && find_python; } || {
    echo "No usable Python: put CPython 3.13 (for bpy 5.2) or 3.11 (for bpy 4.5), with its venv module, on PATH, or name it:" \
      "make PYTHON=/path/to/python3.13" >&2
    exit 1
  }
  sh tools/system_packages.sh "$found"
  say "Setting up $venv with Python $(version "$found") ($found); bpy is about 400 MB to download"
  if [ "$how" = can_make_venv ]; then
    "$found" -m venv "$venv"
  else
    "$found" -m venv --without-pip "$venv"
    "$found" -m pip --python "$venv/bin/python" install --quiet pip
  fi
else
  sh tools/system_packages.sh "$venv/bin/python"
  say "Updating $venv, Python $(version "$venv/bin/python"): pyproject.toml has changed"
fi
rm -f "$ready"

"$venv/bin/python" - >"$venv/requirements.txt" <<'END'
import tomllib
with open("pyproject.toml", "rb") as file:
    data = tomllib.load(file)
print(*data["project"]["dependencies"], *data["dependency-groups"]["dev"], sep="\n")
END
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --upgrade -r "$venv/requirements.txt" >&2

"$venv/bin/python" -c 'import bpy' >/dev/null 2>"$venv/bpy.log" || {
  echo "The bpy module cannot be imported into $venv: $(tail -n 1 "$venv/bpy.log")" >&2
  exit 1
}

mkdir -p "$venv/src"
rm -f "$venv/src/photon_bake"
ln -s "$(pwd)" "$venv/src/photon_bake"
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
(cd "$venv/src" && pwd) >"$site/photon_bake.pth"
echo "$stamp" >"$ready"
