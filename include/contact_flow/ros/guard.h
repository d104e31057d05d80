// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/console.h>

#include <exception>

namespace contact_flow {
namespace ros_interface {

/// Runs a service handler's body: what it throws is the answer, with success = false.
template <class Response, class Body>
bool Guard(const char* service, Response* out, const Body& body) {
  try {
    body();
    out->success = true;
  } catch (const std::exception& error) {
    out->success = false;
    out->message = error.what();
  } catch (...) {
    out->success = false;
    out->message = "unknown error";
  }
  if (!out->success) ROS_WARN("%s: %s", service, out->message.c_str());
  return true;
}

}  // namespace ros_interface
}  // namespace contact_flow
