// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include "contact_flow/ros/guard.h"
#include "contact_flow/ros/outlet.h"

/// What the handlers of services and actions have in common.
namespace contact_flow {
namespace ros_interface {

/// Records and publishes a result. Not being able to record what was to be recorded is a failure,
/// but the result is answered all the same.
template <class Record, class Response>
void Deliver(Outlet* outlet, Record* record, Response* out) {
  out->outcome = record->result.outcome;
  out->message = record->result.message;
  try {
    out->recorded = outlet->Deliver(record);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("NOT RECORDED: ") + error.what() +
                             "; the result itself is complete");
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
