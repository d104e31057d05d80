// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/verification/verify.h"

int main(int argc, char** argv) { return contact_flow::ros_interface::RunVerifyBag(argc, argv); }
