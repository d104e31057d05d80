// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <rosbag/bag.h>

#include <cstdint>
#include <memory>
#include <string>

/// How bags come and go. The constructor of rosbag::Bag looks for plugins, which may not happen in
/// two threads at once, whatever the bags (it ends in SIGSEGV), and its destructor puts them back:
/// in one process only one thread at a time opens or closes. Nobody else makes a rosbag::Bag.
/// Messages may be written to and read from several bags at once.
namespace contact_flow {
namespace ros_interface {

/// A bag that is open. Throws rosbag::BagException.
std::unique_ptr<rosbag::Bag> OpenBag(const std::string& path, rosbag::bagmode::BagMode mode);

/// Closes and destroys a bag, if there is one. Throws rosbag::BagException for one that could not
/// be written to its end.
void CloseBag(std::unique_ptr<rosbag::Bag> bag);

/// For a bag that failed to write: it may not be destroyed (its destructor writes again, throws,
/// and ends the process), so that its memory is lost.
void GiveUpBag(std::unique_ptr<rosbag::Bag> bag);

}  // namespace ros_interface
}  // namespace contact_flow
