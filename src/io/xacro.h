// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace contact_flow {

/// Whether a file is to be run through xacro: by its name, or because its text is a program for it
/// (a call of a macro that nothing defines is none: what xacro left over, which ParseUrdf judges).
bool IsXacro(const std::string& path, const std::string& text);

/// What the program `xacro` makes of the file. Throws std::invalid_argument with what it says,
/// where it is not installed, takes longer than 60 s or answers with more than a URDF may be. The
/// file's expressions are run as programs: only for files that are trusted.
std::string RunXacro(const std::string& path);

}  // namespace contact_flow
