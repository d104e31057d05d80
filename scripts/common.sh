# shellcheck shell=bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Sourced by scripts/test and scripts/demo:
#   prepare            install what is missing, find ROS
#   build [target …]   configure and build (`all` by default)
#   source_devel       put the built package into this shell's environment
#   free_port          print an unused TCP port
# BUILD_DIR (default build/) and JOBS (default: every core) may be set by the caller.

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
BUILD_DIR=$(realpath -m "${BUILD_DIR:-$ROOT/build}")
JOBS=${JOBS:-$(nproc)}
case $ROOT$BUILD_DIR in
  *[[:space:]]*) echo "catkin cannot build in a path with a space: $ROOT" >&2; exit 2 ;;
esac

## Environment

export PATH=/usr/bin:/bin:$PATH   # the system's python3 before one of pyenv or conda
unset PYTHONHOME PYTHONSTARTUP VIRTUAL_ENV
if [ -z "${ROS_PACKAGE_PATH:-}" ]; then   # no workspace is sourced: start from nothing
  unset PYTHONPATH CMAKE_PREFIX_PATH AMENT_PREFIX_PATH
fi

# Until `prepare` has run there is a shell, coreutils, sed, grep and apt, no more: no Python, no ss.
# The kernel's own list of sockets tells which ports are taken; those that it gives to whom asks for any
# (from 32768 on) are left to it.
free_port() {
  local port
  while :; do
    port=$((20000 + (RANDOM * 32768 + RANDOM) % 12768))
    grep -qsiE "^ *[0-9]+: [0-9A-F]+:$(printf %04X "$port") " /proc/net/tcp /proc/net/tcp6 || break
  done
  echo "$port"
}

# A master of our own, on this machine: the user's may drive a real robot.
unset ROS_IP
ROS_HOSTNAME=127.0.0.1
ROS_MASTER_URI=http://127.0.0.1:$(free_port)
ROS_HOME=$BUILD_DIR/ros
ROS_LOG_DIR=$BUILD_DIR/ros/log
ROSCONSOLE_STDOUT_LINE_BUFFERED=1
export ROS_HOSTNAME ROS_MASTER_URI ROS_HOME ROS_LOG_DIR ROSCONSOLE_STDOUT_LINE_BUFFERED

## Packages

COMMON_PACKAGES=(
  build-essential cmake ninja-build pkg-config
  libeigen3-dev libboost-dev libyaml-cpp-dev nlohmann-json3-dev liburdfdom-dev
  libconsole-bridge-dev libssl-dev googletest libgtest-dev python3-numpy python3-matplotlib
  python3 python3-dev python3-yaml pybind11-dev)

# Installed where the distribution has them: linear programs; Ipopt, for multiple shooting; meshes other than STL and OBJ; mypy, for
# the types of the Python module; three.js for reports (libjs-three), and chromium with its driver, which opens them; sweeps on disks and clusters
# (python3-zarr, python3-distributed); what scripts/check asks;
# CVODES and NLopt, in benchmarks; valgrind, which counts instructions; what tests and benchmarks compare with.
# Debian 13 has no Siconos, Ubuntu 20.04 KDL alone.
OPTIONAL_PACKAGES=(
  coinor-libclp-dev coinor-libipopt-dev libassimp-dev mypy libjs-three chromium chromium-driver python3-selenium python3-zarr python3-distributed libsundials-dev libopenmpi-dev libnlopt-dev valgrind
  clang-format-14 cppcheck shellcheck
  liborocos-kdl-dev libmujoco-dev libdart-dev libdart-external-ikfast-dev coinor-csdp
  libsiconos-numerics-dev libsiconos-kernel-dev)

# A message package is three here: headers (lib*-dev), .msg files (ros-*), Python classes (python3-*).
DEBIAN_PACKAGES=(
  catkin ros-message-generation ros-message-runtime
  libroscpp-dev librosbag-dev librostest-dev pluginlib-dev libdiagnostic-updater-dev
  libactionlib-dev python3-actionlib
  libtf2-ros-dev libtf2-eigen-dev liburdf-dev
  libdynamic-reconfigure-config-init-mutex-dev python3-dynamic-reconfigure
  libactionlib-msgs-dev ros-actionlib-msgs python3-actionlib-msgs
  libdiagnostic-msgs-dev ros-diagnostic-msgs python3-diagnostic-msgs
  libgeometry-msgs-dev ros-geometry-msgs python3-geometry-msgs
  libnav-msgs-dev ros-nav-msgs python3-nav-msgs
  libros-rosgraph-msgs-dev python3-rosgraph-msgs
  libsensor-msgs-dev ros-sensor-msgs python3-sensor-msgs
  libstd-msgs-dev ros-std-msgs python3-std-msgs
  libstd-srvs-dev ros-std-srvs python3-std-srvs
  libtf2-msgs-dev ros-tf2-msgs python3-tf2-msgs
  libtrajectory-msgs-dev ros-trajectory-msgs python3-trajectory-msgs
  libvisualization-msgs-dev ros-visualization-msgs python3-visualization-msgs
  ros-robot-state-publisher rosout rosbash
  python3-rospy python3-roslaunch python3-rostest python3-rosunit python3-rosbag python3-rostopic
  python3-rosservice python3-rosnode python3-rosmsg python3-rosparam)

NOETIC_PACKAGES=(
  ros-noetic-ros-base ros-noetic-actionlib ros-noetic-diagnostic-updater
  ros-noetic-dynamic-reconfigure ros-noetic-nav-msgs ros-noetic-pluginlib ros-noetic-tf2-eigen ros-noetic-tf2-ros ros-noetic-urdf
  ros-noetic-trajectory-msgs ros-noetic-visualization-msgs ros-noetic-robot-state-publisher
  ros-noetic-rostest ros-noetic-roslaunch)

missing_packages() {
  comm -13 \
    <(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "$@" 2>/dev/null \
      | sed -n 's/^installed //p' | sort -u) \
    <(printf '%s\n' "$@" | sort -u)
}

# Those of "$@" that apt knows. Without apt's lists, as in a fresh container, it knows none.
known_packages() {
  comm -12 <(apt-cache pkgnames | sort -u) <(printf '%s\n' "$@" | sort -u)
}

as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    echo "neither root nor sudo: install the packages first" >&2
    return 1
  fi
}

update_lists() {
  local try
  for try in 1 2 3; do
    as_root apt-get -qq -o DPkg::Lock::Timeout=600 update && return
    sleep $((5 * try))
  done
}

# Installs what is missing of "$@", and of OPTIONAL_PACKAGES what apt knows. Calls apt only when there
# is something to install.
install_packages() {
  local missing optional
  mapfile -t missing < <(missing_packages "$@")
  [ ${#missing[@]} -eq 0 ] || update_lists
  mapfile -t optional < <(missing_packages "${OPTIONAL_PACKAGES[@]}")
  [ ${#optional[@]} -eq 0 ] || mapfile -t optional < <(known_packages "${optional[@]}")
  if [ ${#missing[@]} -eq 0 ]; then
    [ ${#optional[@]} -gt 0 ] || return 0
    update_lists
  fi
  missing+=("${optional[@]}")
  echo "== install ${#missing[@]} packages: ${missing[*]}"
  logged install as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y \
    -o DPkg::Lock::Timeout=600 --no-install-recommends install "${missing[@]}"
}

prepare() {
  if [ -d /opt/ros/noetic ]; then
    install_packages "${COMMON_PACKAGES[@]}" "${NOETIC_PACKAGES[@]}"
    [ -n "${ROS_PACKAGE_PATH:-}" ] || source_setup /opt/ros/noetic/setup.bash
  else
    install_packages "${COMMON_PACKAGES[@]}" "${DEBIAN_PACKAGES[@]}"
  fi
}

# catkin's setup files read unset variables and "$@". The flags are restored from $-, because
# errexit is off inside the $( ) of the usual `set +o`. They keep a ROS_MASTER_URI that is set.
source_setup() {
  local flags=$- file=$1
  set --
  set +eu
  # shellcheck disable=SC1090
  . "$file"
  case $flags in *e*) set -e ;; esac
  case $flags in *u*) set -u ;; esac
}

source_devel() { source_setup "$BUILD_DIR/devel/setup.bash"; }

## Build

# logged NAME command …: one line "== NAME", the output in a file, its errors shown on failure.
logged() {
  local name=$1 log=$BUILD_DIR/log/$1.txt start=$SECONDS
  shift
  mkdir -p "$BUILD_DIR/log"
  if ! "$@" >"$log" 2>&1; then
    echo "== $name FAILED ($log):" >&2
    { grep -m 8 -E -A 12 '^FAILED|[Ee]rror[: ]|^E: ' "$log" || tail -n 40 "$log"; } | cut -c1-300 >&2
    return 1
  fi
  echo "== $name ($((SECONDS - start)) s)"
}

# Of scripts/check and scripts/fuzz: AddressSanitizer, UBSan and Eigen's assertions. What watches takes Eigen's memory as a core
# without sanitizers does. Eigen refers to the first entry of matrices that have none; a null that is used is a signal, and told.
# shellcheck disable=SC2034  # used there
SANITIZERS="-O1 -g1 -UNDEBUG -DEIGEN_MALLOC_ALREADY_ALIGNED=1 -fno-omit-frame-pointer \
-fsanitize=address,undefined -fno-sanitize=null -fno-sanitize-recover=undefined"

configure() {
  local cache=$BUILD_DIR/CMakeCache.txt generator=()
  # A copied or moved build directory remembers another place: start again.
  if [ -f "$cache" ] && ! { grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$ROOT" "$cache" \
      && grep -qxF "CMAKE_CACHEFILE_DIR:INTERNAL=$BUILD_DIR" "$cache"; }; then
    echo "== $BUILD_DIR was configured elsewhere: removed"
    rm -rf "$BUILD_DIR"
  fi
  [ -f "$cache" ] || generator=(-G Ninja)
  # Both names of the interpreter: catkin looks for the first, Debian's rosbag for the second.
  logged configure cmake -S "$ROOT" -B "$BUILD_DIR" "${generator[@]}" \
    -DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3 \
    -DCATKIN_ENABLE_TESTING=ON -DCMAKE_EXPORT_COMPILE_COMMANDS=ON "$@"
}

build() {
  configure
  logged build cmake --build "$BUILD_DIR" -j "$JOBS" --target "${@:-all}"
}
