# SPDX-License-Identifier: BSD-3-Clause
# PACKAGE_VERSION: that of package.xml, the one place where it is written.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/../package.xml PACKAGE_VERSION REGEX "<version>")
string(REGEX REPLACE ".*<version>([0-9.]+)</version>.*" "\\1" PACKAGE_VERSION "${PACKAGE_VERSION}")
