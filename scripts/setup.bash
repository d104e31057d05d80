# SPDX-License-Identifier: BSD-3-Clause
#
# To be sourced by bash: what scripts/demo and scripts/test have built, in this shell, as devel/setup.bash is in
# a catkin workspace. rosrun does not look into folders named build: the programs are on the PATH besides.
_contact_flow_build=${BUILD_DIR:-$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")/build}
if [ -f "$_contact_flow_build/devel/setup.bash" ]; then
  # shellcheck disable=SC1091
  . "$_contact_flow_build/devel/setup.bash"
  PATH=$_contact_flow_build/devel/lib/contact_flow:$PATH
else
  echo "nothing is built in $_contact_flow_build: run scripts/demo first" >&2
fi
unset _contact_flow_build
