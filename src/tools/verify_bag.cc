// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/verify.h"

int main(int argc, char** argv) { return contact_flow::ros_interface::RunVerifyBag(argc, argv); }
