// SPDX-License-Identifier: BSD-3-Clause
#include "directions.h"

#include <algorithm>
#include <stdexcept>

#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/nearest_name.h"
#include "number_checks.h"

namespace contact_flow {
namespace {

const char kRate[] = "d/dt ";

/// The names of all unit tangents, in their order.
std::vector<std::string> TangentNames(const SystemDescription& description,
                                      const Variables& variables) {
  std::vector<std::string> names = description.velocities;
  for (const std::string& velocity : description.velocities) names.push_back(kRate + velocity);
  for (const std::string& name : VariableNames(description, variables)) names.push_back(name);
  return names;
}

/// "left_foot_z", "+left_foot_z", "-d/dt left_foot_z", "+parameter gravity": a signed unit vector.
Vector ParseDirection(const std::string& field, const std::string& text,
                      const std::vector<std::string>& tangents) {
  std::string name = text;
  double sign = 1;
  if (!name.empty() && (name[0] == '+' || name[0] == '-')) {
    if (name[0] == '-') sign = -1;
    name.erase(0, 1);
  }
  const auto it = std::find(tangents.begin(), tangents.end(), name);
  if (it == tangents.end()) {
    const bool rate = name.compare(0, sizeof(kRate) - 1, kRate) == 0;
    throw std::invalid_argument(
        field + " is " + QuoteName(text) + ": " +
        UnknownName("coordinate", rate ? name.substr(sizeof(kRate) - 1) : name, tangents));
  }
  return sign * Vector::Unit(static_cast<Eigen::Index>(tangents.size()), it - tangents.begin());
}

std::vector<std::string> DefaultNames(const std::vector<std::string>& tangents) {
  std::vector<std::string> names;
  for (const std::string& tangent : tangents) {
    names.push_back("+" + tangent);
    names.push_back("-" + tangent);
  }
  return names;
}

/// Appends the rows of the matrix, of which rows and cols may be left 0.
void AppendRows(const AskedDirections::Rows& matrix, std::size_t cols, Directions* directions) {
  if (matrix.data.empty() && matrix.rows == 0) return;
  const std::string field = "direction_matrix";
  if (matrix.cols != 0 && matrix.cols != cols) {
    throw std::invalid_argument(field + ".cols is " + std::to_string(matrix.cols) + ", expected " +
                                std::to_string(cols) + ", in the order (δq, δv, δu, δp)");
  }
  const std::size_t rows = matrix.rows != 0 ? matrix.rows : matrix.data.size() / cols;
  if (matrix.data.size() != rows * cols) {
    throw std::invalid_argument(field + ".data has " + std::to_string(matrix.data.size()) +
                                " entries, expected " + std::to_string(rows) + " × " +
                                std::to_string(cols));
  }
  CheckFinite(field + ".data", matrix.data);
  for (std::size_t i = 0; i < rows; ++i) {
    directions->names.push_back(field + "[" + std::to_string(i) + "]");
    directions->vectors.push_back(
        Eigen::Map<const Vector>(matrix.data.data() + i * cols, static_cast<Eigen::Index>(cols)));
  }
}

std::string Join(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void CheckCount(std::size_t count) {
  if (count <= kMaxDirections) return;
  throw std::invalid_argument("directions and direction_matrix have " + std::to_string(count) +
                              " directions, at most " + std::to_string(kMaxDirections) +
                              " are accepted");
}

/// Judges every direction against the constraints that are active at the start.
Directions Admit(const Setup& setup, const ResolvedRun& run, const Directions& asked,
                 bool by_default, bool project, const Variables& variables) {
  const ContactMode mode = InitialMode(*setup.system, run.x, run.input.values.front(), run.options);
  ContactDynamics dynamics(*setup.system, run.input.values.front(), variables);
  const StartCone start(&dynamics, run.x, mode, 0, run.options.gap_tolerance,
                        run.options.speed_tolerance, run.options.impact_law);
  if (mode.Empty() && setup.system->num_bilateral() == 0 && start.Empty()) return asked;
  const StartDirections admitted(*setup.system, run.x, mode, start, variables);
  const std::string label = mode.ToString(setup.system->description().constraints);
  using Kind = StartDirections::Judgement::Kind;
  Directions kept;
  std::vector<std::string> left_out, projected, out_of_domain, against_slip;
  for (std::size_t i = 0; i < asked.vectors.size(); ++i) {
    Vector w = asked.vectors[i];
    StartDirections::Judgement judgement = admitted.Judge(w);
    const bool leaves = judgement.kind == Kind::kLeavesMode;
    if (leaves && project) {
      w = admitted.Project(w);
      judgement = admitted.Judge(w);
    }
    if (!by_default && !judgement.ok()) {
      throw std::invalid_argument(
          "direction " + asked.names[i] + " " + admitted.Sentence(judgement) +
          (leaves && !project ? "; set project_directions to use its projection" : ""));
    }
    if (leaves && (!project || (by_default && w.isZero(0)))) {
      left_out.push_back(asked.names[i]);
      continue;
    }
    if (!judgement.ok()) {
      const auto out = static_cast<std::size_t>(judgement.constraint);
      (judgement.kind == Kind::kAgainstSlip ? against_slip : out_of_domain)
          .push_back(asked.names[i] + " ('" + setup.system->description().constraints[out] + "')");
      continue;
    }
    if (leaves) projected.push_back(asked.names[i]);
    kept.names.push_back(asked.names[i]);
    kept.vectors.push_back(w);
  }
  using Fate = DirectionNote::Kind;
  const auto note = [&](Fate fate, const std::string& text, const std::vector<std::string>& names) {
    if (!names.empty()) kept.notes.push_back({fate, text + ": " + Join(names)});
  };
  note(Fate::kLeftOut, "left out, because they leave the initial contact mode " + label, left_out);
  note(Fate::kProjected, "projected on the directions that keep the initial contact mode " + label,
       projected);
  note(Fate::kLeftOut,
       "left out, because they lead through constraints that the initial state touches",
       out_of_domain);
  note(Fate::kLeftOut,
       "left out, because they move contacts that begin to slip against that slip, and how it is "
       "reversed is not followed",
       against_slip);
  return kept;
}

}  // namespace

Variables ResolveVariables(const Setup& setup, bool by_inputs,
                           const std::vector<std::string>& by_parameters) {
  Variables variables;
  variables.inputs = by_inputs;
  try {
    variables.parameters = ParameterIndices(setup.system->description(), by_parameters);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("by_parameters: ") + error.what());
  }
  return variables;
}

std::vector<std::string> VariableNames(const SystemDescription& description,
                                       const Variables& variables) {
  std::vector<std::string> names;
  if (variables.inputs) {
    for (const std::string& input : description.inputs) names.push_back("input " + input);
  }
  for (int k : variables.parameters) {
    names.push_back("parameter " + description.parameters[static_cast<std::size_t>(k)].name);
  }
  return names;
}

Directions ResolveDirections(const Setup& setup, const ResolvedRun& run,
                             const AskedDirections& asked, const Variables& variables) {
  const std::vector<std::string>& names = asked.names;
  const AskedDirections::Rows& matrix = asked.matrix;
  const std::vector<std::string> tangents = TangentNames(setup.system->description(), variables);
  const std::size_t cols = tangents.size();
  CheckCount(names.size() + std::max<std::size_t>(matrix.rows, matrix.data.size() / cols));
  Directions directions;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string field = "directions[" + std::to_string(i) + "]";
    directions.vectors.push_back(ParseDirection(field, names[i], tangents));
    const bool is_signed = names[i][0] == '+' || names[i][0] == '-';
    directions.names.push_back((is_signed ? "" : "+") + names[i]);
  }
  AppendRows(matrix, cols, &directions);
  const bool by_default = directions.vectors.empty();
  if (by_default) {
    directions.names = DefaultNames(tangents);
    for (const std::string& name : directions.names) {
      directions.vectors.push_back(ParseDirection("", name, tangents));
    }
  }
  return Admit(setup, run, directions, by_default, asked.project, variables);
}

}  // namespace contact_flow
