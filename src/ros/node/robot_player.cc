// SPDX-License-Identifier: BSD-3-Clause
#include "robot_player.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/ComputeBDerivative.h"
#include "contact_flow/SimulateTrajectory.h"
#include "contact_flow/nearest_name.h"
#include "parameters.h"
#include "src/ros/message/gate.h"
#include "src/ros/request/model_description.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Most orders of impacts that are shown.
constexpr std::size_t kMaxGhostOrders = 6;

void ReadWithin(MapReader* reader, const char* name, double smallest, double largest,
                double* value) {
  reader->Read(name, value);
  if (*value >= smallest && *value <= largest) return;
  throw std::invalid_argument(ros::this_node::getName() + "/" + name + " is " +
                              std::to_string(*value) + ", expected " + std::to_string(smallest) +
                              " to " + std::to_string(largest));
}

/// Row i of a matrix.
Vector Row(const RowMajorMatrix& matrix, std::size_t i) {
  const auto cols = static_cast<Eigen::Index>(matrix.cols);
  return Eigen::Map<const Vector>(matrix.data.data() + i * matrix.cols, cols);
}

Vector Join(const std::vector<double>& q, const std::vector<double>& v) {
  Vector x(static_cast<Eigen::Index>(q.size() + v.size()));
  std::copy(q.begin(), q.end(), x.data());
  std::copy(v.begin(), v.end(), x.data() + q.size());
  return x;
}

/// The mode of a word, which comes from outside: of letters that are none nothing follows.
ContactMode ModeOf(const std::string& word, int n) {
  ContactMode mode;
  for (int i = 0; i < n && i < static_cast<int>(word.size()); ++i) {
    const char letter = word[static_cast<std::size_t>(i)];
    if (std::string("ls+-").find(letter) != std::string::npos) {
      mode.Set(i, static_cast<Letter>(letter));
    }
  }
  return mode;
}

/// Throws unless a matrix that comes from outside has this size, and numbers that may pass.
void CheckMatrix(const char* field, const RowMajorMatrix& matrix, std::size_t rows, int cols) {
  const bool fits = matrix.rows == rows && matrix.cols == static_cast<std::uint32_t>(cols) &&
                    matrix.data.size() == rows * static_cast<std::size_t>(cols);
  if (!fits) {
    throw std::invalid_argument(std::string(field) + " has " + std::to_string(matrix.rows) + " x " +
                                std::to_string(matrix.cols) + " entries, of which " +
                                std::to_string(matrix.data.size()) + " are there, expected " +
                                std::to_string(rows) + " x " + std::to_string(cols));
  }
  for (const double number : matrix.data) CheckNumber(field, number);
}

/// … unless what is shown of a run may be of this system.
void CheckRun(const ContactTrajectory& run, const MechanicalSystem& system) {
  if (run.t.empty() || run.arcs.empty()) throw std::invalid_argument("t or arcs are empty");
  for (const double t : run.t) CheckNumber("t", t);
  CheckMatrix("q", run.q, run.t.size(), system.num_positions());
  CheckMatrix("v", run.v, run.t.size(), system.dof());
  for (const TrajectoryArc& arc : run.arcs) {
    CheckMessage(arc);
    if (arc.input.size() == static_cast<std::size_t>(system.num_inputs())) continue;
    throw std::invalid_argument("arcs.input has " + std::to_string(arc.input.size()) +
                                " entries, expected " + std::to_string(system.num_inputs()));
  }
}

/// The k-th of a few colours that are easy to tell apart, transparent.
std_msgs::ColorRGBA GhostColor(std::size_t k) {
  constexpr double kColors[][3] = {{0.9, 0.2, 0.2}, {0.2, 0.4, 0.9}, {0.2, 0.7, 0.3},
                                   {0.8, 0.6, 0.1}, {0.6, 0.3, 0.8}, {0.2, 0.7, 0.8}};
  const double* color = kColors[k % 6];
  return Color(color[0], color[1], color[2], 0.3);
}

/// What a user sees first: the robot pitched or, without a base that can, moved by its first
/// number; both ways.
std::vector<std::string> DefaultDirections(const std::vector<std::string>& velocities) {
  std::string name = velocities.front();
  for (const char* pitch : {"base_pitch", "base_wy"}) {
    if (std::count(velocities.begin(), velocities.end(), pitch) > 0) name = pitch;
  }
  return {"+" + name, "-" + name};
}

}  // namespace

PlayerParameters ReadPlayerParameters() {
  PlayerParameters p;
  MapReader reader(PrivateParameters(), ros::this_node::getName());
  reader.Read("source", &p.source);
  ReadWithin(&reader, "duration", 0, 1e6, &p.duration);
  ReadWithin(&reader, "speed", 1e-6, 1e6, &p.speed);
  ReadWithin(&reader, "pause", 0, 3600, &p.pause);
  ReadWithin(&reader, "rate", 0.1, 1000, &p.rate);
  reader.Read("directions", &p.directions);
  ReadWithin(&reader, "size", 0, 1e3, &p.size);
  reader.Read("world_frame", &p.display.world_frame);
  reader.Read("base_frame", &p.display.base_frame);
  std::string prefix;
  reader.Read("tf_prefix", &prefix);
  if (!prefix.empty()) p.display.prefix = prefix + "/";
  reader.Finish();
  return p;
}

RobotPlayer::RobotPlayer(const PlayerParameters& parameters, const ModelDescription& description)
    : parameters_(parameters),
      setup_(FromMsg(description)),
      display_(setup_.robot != nullptr
                   ? *setup_.robot
                   : throw std::invalid_argument("'" + description.name +
                                                 "' is no robot: there is no URDF to show"),
               description.urdf, parameters.display),
      private_("~") {
  constexpr bool kLatch = true;
  joint_states_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
  contacts_ = private_.advertise<visualization_msgs::MarkerArray>("contacts", 10);
  terrain_ = private_.advertise<visualization_msgs::MarkerArray>("terrain", 1, kLatch);
  ghosts_ = private_.advertise<visualization_msgs::MarkerArray>("ghosts", 1, kLatch);
  terrain_.publish(display_.Terrain());
  static_transforms_.sendTransform(display_.StaticTransforms(ros::Time::now()));
  trajectory_subscriber_ =
      node_.subscribe(parameters_.source + "/trajectory", 1, &RobotPlayer::TakeTrajectory, this);
  derivative_subscriber_ =
      node_.subscribe(parameters_.source + "/b_derivative", 1, &RobotPlayer::TakeDerivative, this);
  timer_ = node_.createTimer(ros::Duration(1 / parameters_.rate), &RobotPlayer::Play, this);
}

void RobotPlayer::TakeTrajectory(const ContactTrajectory::ConstPtr& trajectory) {
  try {
    CheckRun(*trajectory, *setup_.system);
  } catch (const std::invalid_argument& error) {
    ROS_WARN("a trajectory of '%s' is not of this robot and left out: %s",
             Cut(trajectory->model, 60).c_str(), error.what());
    return;
  }
  trajectory_ = trajectory;
  dynamics_ =
      std::make_unique<ContactDynamics>(*setup_.system, Vector::Zero(setup_.system->num_inputs()));
  begin_ = ros::Time::now();
}

void RobotPlayer::TakeDerivative(const OutcomeDerivative::ConstPtr& derivative) {
  visualization_msgs::MarkerArray all = RobotDisplay::Nothing();
  std::size_t count = 0;
  const auto show = [&](const Vector& x, const std::string& name) {
    if (!x.allFinite()) return;
    const auto ghost = display_.Ghost(x, name, GhostColor(count++));
    all.markers.insert(all.markers.end(), ghost.markers.begin(), ghost.markers.end());
  };
  const Vector x = Join(derivative->final_q, derivative->final_v);
  const RowMajorMatrix& rows = derivative->derivatives;
  const bool fits = x.size() == setup_.system->state_size() &&
                    static_cast<int>(rows.cols) == 2 * setup_.system->dof() &&
                    derivative->direction_names.size() * rows.cols <= rows.data.size();
  for (std::size_t i = 0; fits && i < derivative->direction_names.size(); ++i) {
    show(setup_.system->Perturb(x, parameters_.size * Row(rows, i)),
         "outcome of " + derivative->direction_names[i]);
  }
  for (const ContactOrder& order : derivative->orders) {
    const Vector end = Join(order.final_q, order.final_v);
    if (count >= kMaxGhostOrders || end.size() != setup_.system->state_size()) continue;
    std::string name = "outcome of the order";
    for (const std::string& constraint : order.order) name += " " + constraint;
    show(end, name);
  }
  ghosts_.publish(all);
}

void RobotPlayer::Sample(double t, Vector* x, ContactMode* mode, Vector* u) const {
  const ContactTrajectory& run = *trajectory_;
  std::size_t k = 0;
  while (k + 1 < run.arcs.size() && run.arcs[k].t_end <= t) ++k;
  const TrajectoryArc& arc = run.arcs[k];
  const std::size_t first = std::min<std::size_t>(arc.first_sample, run.t.size() - 1);
  const std::size_t last =
      std::min<std::size_t>(first + std::max(arc.num_samples, 1u), run.t.size()) - 1;
  const auto at = std::upper_bound(run.t.begin() + first, run.t.begin() + last + 1, t);
  const auto after = std::clamp<std::size_t>(at - run.t.begin(), first, last);
  const std::size_t before = after > first ? after - 1 : first;
  const auto state = [&](std::size_t i) {
    Vector both(setup_.system->state_size());
    both << Row(run.q, i), Row(run.v, i);
    return both;
  };
  const Vector from = state(before), to = state(after);
  const double span = run.t[after] - run.t[before];
  const double share = span > 0 ? std::clamp((t - run.t[before]) / span, 0., 1.) : 0;
  *x = setup_.system->Perturb(from, share * setup_.system->Separation(to, from));
  *mode = ModeOf(arc.mode_word, setup_.system->num_constraints());
  *u = Eigen::Map<const Vector>(arc.input.data(), static_cast<Eigen::Index>(arc.input.size()));
}

void RobotPlayer::Play(const ros::TimerEvent&) {
  if (!trajectory_) return;
  const ros::Time now = ros::Time::now();
  const double run = trajectory_->t.back() - trajectory_->t.front();
  const double period = run / parameters_.speed + parameters_.pause;
  const double elapsed = std::fmod((now - begin_).toSec(), std::max(period, 1e-3));
  const double t = trajectory_->t.front() + std::min(elapsed * parameters_.speed, run);
  Vector x, u;
  ContactMode mode;
  Sample(t, &x, &mode, &u);
  joint_states_.publish(display_.Joints(x, now));
  transforms_.sendTransform(display_.Transforms(x, now));
  dynamics_->SetInput(u);
  dynamics_->Evaluate(x, mode);
  contacts_.publish(display_.Contacts(x, mode, dynamics_->force(), now));
}

namespace {

constexpr int kCalls = 5;         // of a service whose connection breaks
constexpr double kPatience = 10;  // for a service to be advertised, each time [s]

/// Calls a service of the source, again where its connection breaks, as under load; throws
/// std::runtime_error when nothing answers, or with what it answers when it refuses.
template <class Service>
void AskNode(const std::string& name, Service* call) {
  bool answered = false;
  for (int calls = 0; calls < kCalls && !answered && ros::ok(); ++calls) {
    answered = ros::service::waitForService(name, ros::Duration(kPatience)) &&
               ros::service::call(name, *call);
  }
  if (!answered) throw std::runtime_error(name + " does not answer");
  if (!call->response.success) throw std::runtime_error(name + ": " + call->response.message);
  if (!call->response.message.empty()) {
    ROS_INFO("%s: %s", name.c_str(), call->response.message.c_str());
  }
}

}  // namespace

int RunRobotPlayer() {
  const ros::NodeHandle handle;  // ROS, and its log, outlive what may throw
  try {
    const PlayerParameters parameters = ReadPlayerParameters();
    const auto description =
        ros::topic::waitForMessage<ModelDescription>(parameters.source + "/model_description");
    if (!description) return 0;  // stopped meanwhile
    RobotPlayer player(parameters, *description);
    const std::string simulate = parameters.source + "/simulate";
    if (!ros::service::waitForService(simulate)) return 0;
    SimulateTrajectory run;
    run.request.duration = parameters.duration;
    AskNode(simulate, &run);
    ComputeBDerivative derivative;
    derivative.request.duration = parameters.duration;
    derivative.request.directions = parameters.directions;
    if (parameters.directions.empty()) {
      derivative.request.directions = DefaultDirections(description->velocities);
    }
    derivative.request.project_directions = true;
    derivative.request.continue_orders = true;
    AskNode(parameters.source + "/b_derivative", &derivative);
    ROS_INFO("playing '%s': joint_states, tf, and markers under %s", description->name.c_str(),
             ros::this_node::getName().c_str());
    ros::spin();
    return 0;
  } catch (const std::exception& error) {
    ROS_FATAL("robot_player: %s", error.what());
    return 1;
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
