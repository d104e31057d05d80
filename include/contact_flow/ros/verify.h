// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <string>

#include "contact_flow/ros/verify_session.h"

namespace contact_flow {
namespace ros_interface {

/// What became of the messages of a bag.
struct Verification {
  int verified = 0;  ///< results that were computed again with the same bits, or copies of these
  int differing = 0;
  int skipped = 0;  ///< messages that are no results of this package
};

/// Computes every result of a bag again, with the model and the settings the bag says, and compares
/// it bit for bit; and compares the model itself, and the results on the ordinary topics with those
/// of the records. Prints one line a record, and one for every other message that differs. Throws
/// std::runtime_error for a file that is not a readable bag.
/// The recording of a simulator is repeated from its epochs, inputs and marks; `session` holds what
/// one bag hands on to the next.
Verification VerifyBag(const std::string& path, std::ostream* out, SessionVerifier* session);

/// The command verify_bag: 0 when something was verified and nothing differs, 2 for wrong use,
/// else 1.
int RunVerifyBag(int argc, char** argv);

}  // namespace ros_interface
}  // namespace contact_flow
