// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/parameters.h"

#include <ros/ros.h>

#include <cstdio>
#include <cstdlib>

#include "contact_flow/ros/recorder.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// A tree of ROS parameters as YAML, so that one reader judges files and parameters alike.
YAML::Node ToYaml(XmlRpc::XmlRpcValue& value) {
  YAML::Node node;
  char text[32];
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeInvalid:
      break;
    case XmlRpc::XmlRpcValue::TypeBoolean:
      node = static_cast<bool>(value) ? "true" : "false";
      break;
    case XmlRpc::XmlRpcValue::TypeInt:
      node = std::to_string(static_cast<int>(value));
      break;
    case XmlRpc::XmlRpcValue::TypeDouble:
      std::snprintf(text, sizeof(text), "%.17g", static_cast<double>(value));
      node = std::string(text);
      break;
    case XmlRpc::XmlRpcValue::TypeString:
      node = static_cast<std::string>(value);
      break;
    case XmlRpc::XmlRpcValue::TypeArray:
      node = YAML::Node(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i) node.push_back(ToYaml(value[i]));
      break;
    case XmlRpc::XmlRpcValue::TypeStruct:
      node = YAML::Node(YAML::NodeType::Map);
      for (auto& entry : value) node[entry.first] = ToYaml(entry.second);
      break;
    default:  // dates and binary data: nothing here takes them
      node = YAML::Node(YAML::NodeType::Sequence);
  }
  return node;
}

/// A leading "~/" is the home directory.
std::string ExpandHome(const std::string& path) {
  const char* home = std::getenv("HOME");
  return home && path.compare(0, 2, "~/") == 0 ? home + path.substr(1) : path;
}

}  // namespace

NodeParameters ReadNodeParameters() {
  XmlRpc::XmlRpcValue tree;
  const std::string name = ros::this_node::getName();
  YAML::Node yaml;
  if (ros::param::get(name, tree)) yaml = ToYaml(tree);

  NodeParameters parameters;
  parameters.bag_directory = DefaultBagDirectory();
  MapReader reader(yaml, name);
  std::string model_file;
  reader.Read("model_file", &model_file);
  Configuration base;
  if (!model_file.empty()) base = LoadConfiguration(ExpandHome(model_file));
  parameters.configuration = ReadConfiguration(&reader, base);
  reader.Read("record", &parameters.record);
  reader.Read("bag_name", &parameters.bag_name);
  reader.Read("bag_directory", &parameters.bag_directory);
  parameters.bag_directory = ExpandHome(parameters.bag_directory);
  if (parameters.bag_directory.empty()) parameters.bag_directory = DefaultBagDirectory();
  reader.Read("threads", &parameters.threads, 1, 64);
  reader.Finish();
  return parameters;
}

}  // namespace ros_interface
}  // namespace contact_flow
