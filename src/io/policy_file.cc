// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/policy_file.h"

#include <cmath>
#include <cstdio>
#include <ostream>
#include <stdexcept>
#include <utility>

#include "contact_flow/io/map_reader.h"
#include "contact_flow/io/text_file.h"
#include "contact_flow/mode_text.h"
#include "contact_flow/model/configuration_factors.h"

namespace contact_flow {
namespace {

constexpr long kFormat = 1;  // of the file

// ---- writing

/// In quotes: a name may be "y" or "3".
std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (char letter : text) {
    if (letter == '"' || letter == '\\') quoted += '\\';
    quoted += letter;
  }
  return quoted + "\"";
}

std::string ListOf(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + Quoted(name);
  return "[" + list + "]";
}

std::string Digits(double number) {
  if (std::isinf(number)) return number > 0 ? ".inf" : "-.inf";
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.17g", number);
  return digits;
}

std::string ListOf(const VectorRef& numbers) {
  std::string list;
  for (double number : numbers) list += (list.empty() ? "" : ", ") + Digits(number);
  return "[" + list + "]";
}

std::string ListOf(const std::vector<double>& numbers) {
  return ListOf(VectorRef(
      Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()))));
}

/// All columns as one list, a line each.
void WriteColumns(const std::string& key, const MatrixRef& columns, const std::string& indent,
                  std::ostream* out) {
  *out << indent << key << ": [";
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    const std::string list = ListOf(VectorRef(columns.col(k)));
    *out << (k > 0 ? ",\n" + indent + "  " : "") << list.substr(1, list.size() - 2);
  }
  *out << "]\n";
}

void WritePhase(const ReferencePhase& phase, const std::vector<std::string>& constraints,
                std::ostream* out) {
  *out << "- mode: " << Quoted(phase.mode.Word(static_cast<int>(constraints.size()))) << "\n  "
       << "t_begin: " << Digits(phase.t_begin)
       << "\n  x_begin: " << ListOf(VectorRef(phase.x_begin))
       << "\n  t_end: " << Digits(phase.t_end) << "\n  x_end: " << ListOf(VectorRef(phase.x_end))
       << "\n  activated: " << ListOf(phase.activated.Names(constraints))
       << "\n  released: " << ListOf(phase.released.Names(constraints))
       << "\n  times: " << ListOf(phase.t) << "\n";
  WriteColumns("states", phase.x, "  ", out);
  WriteColumns("accelerations", phase.a, "  ", out);
}

// ---- reading

std::string Entry(const std::string& list, std::size_t k) {
  return list + "[" + std::to_string(k) + "]";
}

Vector ToVector(const std::vector<double>& numbers) {
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

template <class Value>
Value ReadRequired(MapReader* reader, const std::string& key) {
  reader->Require(key);
  Value value{};
  reader->Read(key, &value);
  return value;
}

Vector ReadBounds(MapReader* reader, const std::string& key, bool upper) {
  std::vector<double> bounds;
  reader->Require(key);
  reader->ReadBounds(key, upper, &bounds);
  return ToVector(bounds);
}

Vector ReadVector(MapReader* reader, const std::string& key) {
  return ToVector(ReadRequired<std::vector<double>>(reader, key));
}

/// The maps of a list.
std::vector<YAML::Node> ReadMaps(MapReader* reader, const std::string& key) {
  reader->Require(key);
  const YAML::Node list = reader->Child(key);
  if (!list.IsSequence()) {
    throw std::invalid_argument(key + " is no list" + reader->Line(key));
  }
  return {list.begin(), list.end()};
}

ReferencePhase ReadPhase(const std::string& field, const YAML::Node& node,
                         const std::vector<std::string>& constraints, Eigen::Index nq,
                         Eigen::Index d) {
  MapReader reader(node, field);
  ReferencePhase phase;
  phase.mode = ModeOfWord(field + "/mode", ReadRequired<std::string>(&reader, "mode"),
                          static_cast<int>(constraints.size()));
  phase.t_begin = ReadRequired<double>(&reader, "t_begin");
  phase.t_end = ReadRequired<double>(&reader, "t_end");
  phase.x_begin = ReadVector(&reader, "x_begin");
  phase.x_end = ReadVector(&reader, "x_end");
  const std::pair<const char*, ConstraintSet*> sets[] = {{"activated", &phase.activated},
                                                         {"released", &phase.released}};
  for (const auto& [key, contacts] : sets) {
    *contacts = SetOfNames(field + "/" + key, ReadRequired<std::vector<std::string>>(&reader, key),
                           constraints);
  }
  phase.t = ReadRequired<std::vector<double>>(&reader, "times");
  phase.x =
      ColumnsOf(field + "/states", ReadRequired<std::vector<double>>(&reader, "states"), nq + d);
  phase.a = ColumnsOf(field + "/accelerations",
                      ReadRequired<std::vector<double>>(&reader, "accelerations"), d);
  reader.Finish();
  return phase;
}

PolicyNames ReadNames(MapReader* reader) {
  PolicyNames names;
  names.model = ReadRequired<std::string>(reader, "model");
  names.coordinates = ReadRequired<std::vector<std::string>>(reader, "coordinates");
  names.units = ReadRequired<std::vector<std::string>>(reader, "units");
  names.velocities = ReadRequired<std::vector<std::string>>(reader, "velocities");
  names.constraints = ReadRequired<std::vector<std::string>>(reader, "constraints");
  names.inputs = ReadRequired<std::vector<std::string>>(reader, "inputs");
  return names;
}

void ReadGains(MapReader* reader, Eigen::Index d, TrackingPolicy* policy) {
  const std::vector<YAML::Node> gains = ReadMaps(reader, "gains");
  for (std::size_t k = 0; k < gains.size(); ++k) {
    const std::string field = Entry("gains", k);
    MapReader gain(gains[k], field);
    long phase = 0;
    gain.Require("phase");
    gain.Read("phase", &phase, 0, 1000000);
    policy->gain_phases.push_back(static_cast<int>(phase));
    if (ReadRequired<bool>(&gain, "kinked")) policy->kinked.push_back(static_cast<int>(k));
    policy->gains.push_back(
        ColumnsOf(field + "/rows", ReadRequired<std::vector<double>>(&gain, "rows"), 2 * d)
            .transpose());
    gain.Finish();
  }
}

TrackingPolicy Read(const YAML::Node& document) {
  MapReader reader(document, "");
  long format = 0;
  reader.Require("contact_flow_policy");
  reader.Read("contact_flow_policy", &format, kFormat, kFormat);
  PolicyNames names = ReadNames(&reader);
  const ConfigurationSpace space =
      SpaceOfFactors("factors", ReadRequired<std::vector<std::string>>(&reader, "factors"));
  InputSchedule inputs;
  inputs.grid = ReadRequired<std::vector<double>>(&reader, "grid");
  const Matrix feed_forward =
      ColumnsOf("feed_forward", ReadRequired<std::vector<double>>(&reader, "feed_forward"),
                static_cast<Eigen::Index>(names.inputs.size()));
  for (Eigen::Index k = 0; k < feed_forward.cols(); ++k) {
    inputs.values.push_back(feed_forward.col(k));
  }
  std::vector<ReferencePhase> phases;
  for (const YAML::Node& node : ReadMaps(&reader, "phases")) {
    phases.push_back(ReadPhase(Entry("phases", phases.size()), node, names.constraints,
                               space.num_positions(), space.dof()));
  }
  std::vector<std::string> instants;
  reader.Read("instants", &instants);
  const ConstraintSet of_time = SetOfNames("instants", instants, names.constraints);
  TrackingPolicy policy{std::move(names),
                        ExtendedReference(space, std::move(inputs), std::move(phases), of_time),
                        {},
                        {},
                        {},
                        {},
                        {}};
  ReadGains(&reader, space.dof(), &policy);
  policy.lower = ReadBounds(&reader, "lower", false);
  policy.upper = ReadBounds(&reader, "upper", true);
  reader.Finish();
  CheckPolicy(policy);
  return policy;
}

}  // namespace

Matrix ColumnsOf(const std::string& field, const std::vector<double>& numbers, Eigen::Index rows) {
  const auto size = static_cast<Eigen::Index>(numbers.size());
  if (rows == 0 || size % rows != 0) {
    throw std::invalid_argument(field + " has " + std::to_string(size) +
                                " entries, expected a multiple of " + std::to_string(rows));
  }
  return Eigen::Map<const Matrix>(numbers.data(), rows, size / rows);
}

void WritePolicy(const TrackingPolicy& policy, std::ostream* out) {
  CheckPolicy(policy);
  const PolicyNames& names = policy.names;
  const InputSchedule& inputs = policy.reference.inputs();
  *out << "# How a trajectory through contact is followed: u = feed_forward - K (x - reference),\n"
          "# by phase and instant; docs/trajectories.md. Units: those named, their rates, SI.\n"
       << "contact_flow_policy: " << kFormat << "\nmodel: " << Quoted(names.model)
       << "\ncoordinates: " << ListOf(names.coordinates) << "\nunits: " << ListOf(names.units)
       << "\nvelocities: " << ListOf(names.velocities)
       << "\nfactors: " << ListOf(FactorNames(policy.reference.space()))
       << "\nconstraints: " << ListOf(names.constraints) << "\ninputs: " << ListOf(names.inputs)
       << "\n";
  if (const ConstraintSet instants = policy.reference.instants(); !instants.Empty()) {
    *out << "instants: " << ListOf(instants.Names(names.constraints)) << "\n";
  }
  *out << "grid: " << ListOf(inputs.grid) << "\n";
  Matrix feed_forward(static_cast<Eigen::Index>(names.inputs.size()),
                      static_cast<Eigen::Index>(inputs.values.size()));
  for (std::size_t k = 0; k < inputs.values.size(); ++k) {
    feed_forward.col(static_cast<Eigen::Index>(k)) = inputs.values[k];
  }
  WriteColumns("feed_forward", feed_forward, "", out);
  *out << "lower: " << ListOf(VectorRef(policy.lower))
       << "\nupper: " << ListOf(VectorRef(policy.upper)) << "\ngains:\n";
  for (std::size_t k = 0; k < policy.gains.size(); ++k) {
    bool kinked = false;
    for (int other : policy.kinked) kinked = kinked || other == static_cast<int>(k);
    *out << "- phase: " << policy.gain_phases[k] << "\n  kinked: " << (kinked ? "true" : "false")
         << "\n";
    WriteColumns("rows", policy.gains[k].transpose(), "  ", out);
  }
  *out << "phases:\n";
  for (const ReferencePhase& phase : policy.reference.phases()) {
    WritePhase(phase, names.constraints, out);
  }
}

TrackingPolicy ReadPolicy(const std::string& text, const std::string& name) {
  try {
    if (text.size() > kMaxPolicyBytes) {
      throw std::invalid_argument("the file is longer than " + std::to_string(kMaxPolicyBytes) +
                                  " bytes");
    }
    return Read(ParseYamlDocument(text));
  } catch (const std::exception& error) {  // of YAML, too
    throw std::invalid_argument(name + ": " + error.what());
  }
}

TrackingPolicy ReadPolicyFile(const std::string& path) {
  return ReadPolicy(ReadTextFile(path, kMaxPolicyBytes), path);
}

}  // namespace contact_flow
