# shellcheck shell=bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Sourced by the tests beside it, with the build folder as "$1": a folder for their work, $work, and
# the package installed in it, $prefix.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
build=$1
work=$(mktemp -d)
prefix=$work/prefix
trap 'rm -rf "$work"' EXIT

fail() { echo "FAILED: $*" >&2; exit 1; }
# quiet command …: its output only when it fails
quiet() { "$@" >"$work/output" 2>&1 || { cat "$work/output" >&2; fail "$*"; }; }
# expect TEXT command …: its output holds the text
expect() {
  local text=$1 output
  shift
  output=$("$@" 2>&1) || true
  case $output in *"$text"*) ;; *) fail "'$text' is not in the output of '$*': $output" ;; esac
}

# Debug: the compilation of one model is most of the time of these tests.
configure_user() { quiet cmake -S "$here/$1" -B "$work/$1" -DCMAKE_BUILD_TYPE=Debug "${@:2}"; }

configured=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' "$build/CMakeCache.txt")
touch "$work/before"
quiet cmake --install "$build" --prefix "$prefix"
