// SPDX-License-Identifier: BSD-3-Clause
#include "parameters.h"

#include <ros/ros.h>

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "src/ros/recording/memory_limit.h"
#include "src/ros/recording/recorder.h"

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

/// The robot of the parameters ~robot, path of its YAML, and ~robot_description, text or path of
/// its URDF: without it the file that the YAML names, or, if it names none, the text that a robot
/// is usually described by, `robot_description` of this namespace or the nearest above.
RobotTexts ReadRobot(MapReader* reader, const std::string& name) {
  std::string path, urdf;
  reader->Read("robot", &path);
  reader->Read("robot_description", &urdf);
  if (path.empty()) {
    if (urdf.empty()) return {};
    throw std::invalid_argument(name + "/robot_description: " + name +
                                "/robot, the path of the robot's YAML, is missing");
  }
  if (reader->Has("model") || reader->Has("model_file")) {
    throw std::invalid_argument(name + "/robot: there is a " + name +
                                (reader->Has("model") ? "/model" : "/model_file") +
                                ", too; give one of them");
  }
  std::string key, usual;
  if (ros::param::search("robot_description", key)) ros::param::get(key, usual);
  return ReadRobotTexts(ExpandHome(path), ExpandHome(urdf), usual);
}

}  // namespace

YAML::Node PrivateParameters() {
  XmlRpc::XmlRpcValue tree;
  return ros::param::get(ros::this_node::getName(), tree) ? ToYaml(tree) : YAML::Node();
}

namespace {

void ReadSimulatorParameters(MapReader* reader, const std::string& name, SimulatorParameters* p) {
  ros::param::get("/use_sim_time", p->use_sim_time);
  p->publish_clock = p->use_sim_time;
  reader->Read("online", &p->online);
  reader->Read("paused", &p->paused);
  reader->Read("real_time_factor", &p->real_time_factor);
  reader->Read("rate", &p->rate);
  reader->Read("display_rate", &p->display_rate);
  reader->Read("control_rate", &p->control_rate);
  const auto check = [&](const char* key, double value, double smallest, double largest) {
    if (value >= smallest && value <= largest) return;
    std::ostringstream text;
    text << name << "/" << key << " is " << value << ", expected " << smallest << " to " << largest;
    throw std::invalid_argument(text.str());
  };
  if (p->real_time_factor != 0) {
    check("real_time_factor", p->real_time_factor, Simulator::kSmallestFactor, 1000);
  }
  check("rate", p->rate, 0.1, 10000);
  check("display_rate", p->display_rate, 0.1, 10000);
  check("control_rate", p->control_rate, 0.1, 10000);
  reader->Read("publish_clock", &p->publish_clock);
  if (p->publish_clock && !p->use_sim_time) {
    throw std::invalid_argument(name +
                                "/publish_clock is true, but /use_sim_time is not: no node would " +
                                "follow the clock; set /use_sim_time before any node is started");
  }
  reader->Read("tangent_directions", &p->tangent_directions);
  reader->Read("mark", &p->mark);
  reader->Read("realtime_priority", &p->realtime_priority, 0, 99);
  reader->Read("step_seconds", &p->step_seconds);
  check("step_seconds", p->step_seconds, 0.01, 3600);
  reader->Read("busy_wait", &p->busy_wait);
  if (p->busy_wait && p->realtime_priority > 0) {
    throw std::invalid_argument(
        name + "/busy_wait is true and " + name + "/realtime_priority is " +
        std::to_string(p->realtime_priority) +
        ": a thread of such priority that never sleeps is stopped for 50 ms in every second "
        "(/proc/sys/kernel/sched_rt_runtime_us); choose one of them");
  }
  reader->Read("bag_split_size", &p->bag_split_size);
  check("bag_split_size", p->bag_split_size, 0.01, 2048);
  reader->Read("tf_prefix", &p->display.prefix);
  reader->Read("base_frame", &p->display.base_frame);
  reader->Child("simulator");  // dynamic_reconfigure's, of the last time
}

}  // namespace

Configuration ReadModelParameters(MapReader* reader, const std::string& name) {
  std::string model_file;
  reader->Read("model_file", &model_file);
  Configuration base;
  if (!model_file.empty()) base = LoadConfiguration(ExpandHome(model_file));
  base.robot = ReadRobot(reader, name);
  return ReadConfiguration(reader, base);
}

NodeParameters ReadNodeParameters() {
  NodeParameters parameters;
  parameters.bag_directory = DefaultBagDirectory();
  const std::string name = ros::this_node::getName();
  MapReader reader(PrivateParameters(), name);
  parameters.configuration = ReadModelParameters(&reader, name);
  reader.Read("model_plugins", &parameters.model_plugins);
  reader.Read("record", &parameters.record);
  reader.Read("bag_name", &parameters.bag_name);
  reader.Read("bag_directory", &parameters.bag_directory);
  std::string key;
  reader.Read("signing_key", &key);
  if (!key.empty()) parameters.simulator.signing_key = SigningKey::ReadPrivate(ExpandHome(key));
  parameters.bag_directory = ExpandHome(parameters.bag_directory);
  if (parameters.bag_directory.empty()) parameters.bag_directory = DefaultBagDirectory();
  reader.Read("threads", &parameters.threads, 1, 64);
  reader.Read("queue", &parameters.queue, 0, 256);
  reader.Read("max_memory", &parameters.max_memory);
  if (parameters.max_memory != -1 && parameters.max_memory != 0 &&
      !(parameters.max_memory >= kLeastMemory && parameters.max_memory <= kMostMemory)) {
    std::ostringstream text;
    text << name << "/max_memory is " << parameters.max_memory << " MB, expected " << kLeastMemory
         << " to " << kMostMemory << ", 0 for no limit, or -1 for the default";
    throw std::invalid_argument(text.str());
  }
  ReadSimulatorParameters(&reader, name, &parameters.simulator);
  reader.Finish();
  return parameters;
}

}  // namespace ros_interface
}  // namespace contact_flow
