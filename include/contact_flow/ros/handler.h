// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <stdexcept>
#include <string>

#include "contact_flow/ros/outlet.h"

/// What the handlers of services and actions have in common.
namespace contact_flow {
namespace ros_interface {

/// Runs a handler's body: what it throws is the answer, with success = false.
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

/// Records and publishes a result. Not being able to record what was to be recorded is a failure,
/// but the result is answered all the same.
template <class Record, class Response>
void Deliver(Outlet* outlet, Record* record, Response* out) {
  out->outcome = record->result.outcome;
  out->message = record->result.message;
  out->warnings = record->result.warnings;
  try {
    out->recorded = outlet->Deliver(record);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("NOT RECORDED: ") + error.what() +
                             "; the result itself is complete");
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
