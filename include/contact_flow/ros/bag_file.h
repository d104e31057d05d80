// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace contact_flow {
namespace ros_interface {

/// Writes one message to a bag that is being made.
using BagEntry = std::function<void(rosbag::Bag*)>;

/// The entry of `message` under `topic`; one that is latched is latched by `rosbag play`, too.
template <class Message>
BagEntry MakeBagEntry(const std::string& topic, const ros::Time& stamp, const std::string& caller,
                      boost::shared_ptr<const Message> message, bool latched = true) {
  auto header = boost::make_shared<ros::M_string>();
  (*header)["topic"] = topic;
  (*header)["type"] = ros::message_traits::DataType<Message>::value();
  (*header)["md5sum"] = ros::message_traits::MD5Sum<Message>::value();
  (*header)["message_definition"] = ros::message_traits::Definition<Message>::value();
  (*header)["callerid"] = caller;
  (*header)["latching"] = latched ? "1" : "0";
  return [=](rosbag::Bag* bag) { bag->write(topic, stamp, *message, header); };
}

/// Puts a complete bag with these entries in the place of `path`, in one step: at every instant,
/// also if the process is killed or the power fails, `path` is either the old bag or the new one,
/// and never needs `rosbag reindex`. Returns its size [bytes]. Throws std::runtime_error, with path
/// and reason, when the disk is full or may not be written; the old bag is untouched then.
std::size_t ReplaceBag(const std::string& path, const std::vector<BagEntry>& entries);

}  // namespace ros_interface
}  // namespace contact_flow
