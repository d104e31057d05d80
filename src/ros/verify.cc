// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/verify.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <exception>
#include <iostream>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "contact_flow/AssumptionRecord.h"
#include "contact_flow/ComparisonRecord.h"
#include "contact_flow/ControllabilityRecord.h"
#include "contact_flow/CovarianceRecord.h"
#include "contact_flow/DerivativeRecord.h"
#include "contact_flow/LinearizationRecord.h"
#include "contact_flow/OptimizationRecord.h"
#include "contact_flow/PeriodicOrbitRecord.h"
#include "contact_flow/PoincareRecord.h"
#include "contact_flow/SimulationRecord.h"
#include "contact_flow/StabilityRecord.h"
#include "contact_flow/ros/answers.h"
#include "contact_flow/ros/assumptions_answer.h"
#include "contact_flow/ros/controllability_answer.h"
#include "contact_flow/ros/conversions.h"
#include "contact_flow/ros/covariance_answer.h"
#include "contact_flow/ros/linearize_answer.h"
#include "contact_flow/ros/optimization_answer.h"
#include "contact_flow/ros/periodic_orbit_answer.h"
#include "contact_flow/ros/poincare_answer.h"
#include "contact_flow/ros/serialize.h"
#include "contact_flow/ros/stability_answer.h"
#include "contact_flow/ros/verify_session.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Goes through one bag.
class Verifier {
 public:
  Verifier(std::ostream* out, SessionVerifier* session) : out_(out), session_(*session) {}

  /// First every message is offered here …
  bool TakeRecord(const rosbag::MessageInstance& message) {
    return Record<SimulationRecord>(message) || Record<DerivativeRecord>(message) ||
           Record<ComparisonRecord>(message) || Record<AssumptionRecord>(message) ||
           Record<LinearizationRecord>(message) || Record<PoincareRecord>(message) ||
           Record<StabilityRecord>(message) || Record<ControllabilityRecord>(message) ||
           Record<CovarianceRecord>(message) || Record<PeriodicOrbitRecord>(message) ||
           Record<OptimizationRecord>(message) || Model(message) ||
           Online<SimulatorEpoch>(message, kAnnounced) || Online<SimulatorInput>(message, kTold) ||
           Online<SimulatorEvent>(message, kAnnounced) || Online<HybridState>(message, kTold) ||
           Online<SimulatorMark>(message, kAnnounced) || Online<RollingTangents>(message, kTold) ||
           Online<PredictionRequest>(message, kTold) || Prediction(message);
  }
  /// … and then, those that were no records, here.
  void TakeOther(const rosbag::MessageInstance& message) {
    const bool known = Copy<ContactTrajectory>(message) || Copy<OutcomeDerivative>(message) ||
                       Copy<ModeSequence>(message);
    if (!known) ++result_.skipped;
  }
  const Verification& result() const { return result_; }

 private:
  static constexpr bool kAnnounced = true, kTold = false;  // whether each has a line of its own

  /// Null unless the message has this type. One that has it by name only was written by another
  /// version.
  template <class Message>
  boost::shared_ptr<Message> Get(const rosbag::MessageInstance& message, bool* is) {
    *is = message.getDataType() == ros::message_traits::DataType<Message>::value();
    if (!*is) return nullptr;
    boost::shared_ptr<Message> m = message.instantiate<Message>();
    if (!m) Differs(message, "written with another definition of " + message.getDataType());
    return m;
  }

  void Line(const rosbag::MessageInstance& message, const std::string& verdict) {
    *out_ << message.getTime() << " " << message.getTopic() << ": " << verdict << "\n";
  }
  void Differs(const rosbag::MessageInstance& message, const std::string& how) {
    ++result_.differing;
    Line(message, "DIFFERS: " + how);
  }

  /// Compares one message; the header, which is the time of recording, is taken over.
  template <class Message>
  bool Same(const rosbag::MessageInstance& message, const Message& recorded, Message computed) {
    computed.header = recorded.header;
    if (Serialize(recorded) == Serialize(computed)) return true;
    Differs(message, FirstDifference(recorded, computed));
    return false;
  }

  bool Model(const rosbag::MessageInstance& message) {
    bool is = false;
    const auto description = Get<ModelDescription>(message, &is);
    if (!description) return is;
    setup_.reset();
    try {
      setup_ = std::make_unique<Setup>(FromMsg(*description));
      if (Same(message, *description, ToMsg(*setup_))) Line(message, description->name);
      session_.Take(*description);
    } catch (const std::invalid_argument& error) {
      Differs(message, error.what());
    }
    return true;
  }

  /// What the simulator has recorded.
  template <class Message>
  bool Online(const rosbag::MessageInstance& message, bool announced) {
    bool is = false;
    const auto recorded = Get<Message>(message, &is);
    if (!recorded) return is;
    std::string difference;
    try {
      difference = session_.Take(*recorded);
    } catch (const std::exception& error) {
      difference = error.what();
    }
    if (!difference.empty()) {
      Differs(message, difference);
      return true;
    }
    ++result_.verified;
    if (announced) Line(message, "same, bit for bit");
    return true;
  }

  bool Prediction(const rosbag::MessageInstance& message) {
    bool is = false;
    const auto recorded = Get<OutcomePrediction>(message, &is);
    if (!recorded) return is;
    if (!session_.Precedes(*recorded)) return Online<OutcomePrediction>(message, kAnnounced);
    ++result_.skipped;
    return true;
  }

  template <class RecordMessage>
  bool Record(const rosbag::MessageInstance& message) {
    bool is = false;
    const auto record = Get<RecordMessage>(message, &is);
    if (!record) return is;
    if (!setup_) {
      Differs(message, "no model description before it");
      return true;
    }
    try {
      if (!Same(message, record->result, Answer(*setup_, record->request))) return true;
    } catch (const std::exception& error) {
      Differs(message, error.what());
      return true;
    }
    if (Serialize(record->header) != Serialize(record->result.header) ||
        record->header.stamp != message.getTime()) {
      Differs(message, "stamps of message, record and result");
      return true;
    }
    Remember(record->result);
    ++result_.verified;
    Line(message, "same, bit for bit");
    return true;
  }

  template <class Result>
  void Remember(const Result& result) {
    results_.insert(Serialize(result));
  }
  void Remember(const ContactTrajectory& result) {
    results_.insert(Serialize(result));
    results_.insert(Serialize(ToModeSequence(result)));
  }

  /// A message on an ordinary topic: it must be one of the results verified before.
  template <class Message>
  bool Copy(const rosbag::MessageInstance& message) {
    bool is = false;
    const auto copy = Get<Message>(message, &is);
    if (copy && !results_.count(Serialize(*copy))) Differs(message, "not the result of any record");
    return is;
  }

  std::ostream* out_;
  SessionVerifier& session_;
  std::unique_ptr<Setup> setup_;
  std::set<Bytes> results_;
  Verification result_;
};

const char kHelp[] =
    "Usage: verify_bag BAG...\n"
    "Computes every result in bags written by contact_flow_node again and compares it bit for "
    "bit.\n"
    "Prints one line a result. Exit code: 0 when at least one result was verified and none "
    "differs,\n"
    "1 when one differs, none was found, or a bag cannot be read, 2 for wrong use.\n";

}  // namespace

Verification VerifyBag(const std::string& path, std::ostream* out, SessionVerifier* session) {
  rosbag::Bag bag;
  bag.open(path, rosbag::bagmode::Read);
  Verifier verifier(out, session);
  rosbag::View view(bag);
  std::vector<rosbag::MessageInstance> others;
  for (const rosbag::MessageInstance& message : view) {
    if (!verifier.TakeRecord(message)) others.push_back(message);
  }
  for (const rosbag::MessageInstance& message : others) verifier.TakeOther(message);
  return verifier.result();
}

int RunVerifyBag(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << kHelp;
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--help" || argument == "-h") {
      std::cout << kHelp;
      return 0;
    }
  }
  Verification total;
  bool readable = true;
  SessionVerifier session;  // of the simulator's bags one goes on where the other ends
  for (int i = 1; i < argc; ++i) {
    try {
      const Verification one = VerifyBag(argv[i], &std::cout, &session);
      total.verified += one.verified;
      total.differing += one.differing;
      total.skipped += one.skipped;
    } catch (const std::exception& error) {
      std::cout << argv[i] << ": " << error.what() << "\n";
      readable = false;
    }
  }
  std::cout << total.verified << " verified, " << total.differing << " differ, " << total.skipped
            << " skipped\n";
  return readable && total.verified > 0 && total.differing == 0 ? 0 : 1;
}

}  // namespace ros_interface
}  // namespace contact_flow
