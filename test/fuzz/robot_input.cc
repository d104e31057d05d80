// SPDX-License-Identifier: BSD-3-Clause
#include "test/fuzz/robot_input.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "test/model/robots.h"

/// When urdfdom itself refuses a loop, its links hold one another and are never freed.
extern "C" const char* __lsan_default_suppressions() { return "leak:urdf::parseURDF\n"; }

namespace contact_flow {
namespace fuzz {
namespace {

[[noreturn]] void Abort(const std::string& finding) {
  std::fprintf(stderr, "FINDING: %s\n", finding.c_str());
  std::abort();
}

void CheckFinite(const char* what, const Eigen::Ref<const Matrix>& values) {
  if (!values.allFinite()) Abort(std::string(what) + " of a robot that was accepted is not finite");
}

/// Everything that a run calls, once.
void Evaluate(const RobotSystem& system) {
  const Vector q = system.nominal().x.head(system.num_positions()),
               v = system.nominal().x.tail(system.dof());
  const Vector& u = system.nominal().u;
  Matrix mass;
  Vector force;
  system.Dynamics(q, v, u, ContactMode(), &mass, &force);
  CheckFinite("the mass matrix", mass);
  CheckFinite("the force", force);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  CheckFinite("a constraint", terms.gap);
  CheckFinite("a constraint's gradient", terms.jacobian);
  CheckFinite("a constraint's acceleration", terms.bias);
  const Vector still = Vector::Zero(system.dof()), none = Vector::Zero(terms.gap.size());
  ResidualJacobian jacobian;
  system.DifferentiateDynamics(q, v, u, ContactMode(), still, none, &jacobian);
  system.DifferentiateImpact(q, still, none, v, &jacobian);
  std::vector<int> parameters;
  for (std::size_t k = 0; k < system.description().parameters.size(); ++k) {
    parameters.push_back(static_cast<int>(k));
  }
  ParameterJacobian by_parameters;
  system.DifferentiateDynamicsByParameters(q, v, u, ContactMode(), still, none, parameters,
                                           &by_parameters);
  system.DifferentiateImpactByParameters(q, still, none, v, parameters, &by_parameters);
}

std::string Replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

}  // namespace

bool Load(const std::string& input) {
  const std::size_t mark = input.find(kYamlFollows);
  RobotTexts texts;
  texts.urdf = input.substr(0, mark);
  texts.yaml =
      mark == std::string::npos ? "base: floating" : input.substr(mark + std::strlen(kYamlFollows));
  try {
    const std::unique_ptr<RobotSystem> system = MakeRobot(texts);
    Evaluate(*system);
    return true;
  } catch (const std::invalid_argument& error) {
    if (std::strlen(error.what()) < 5) Abort("a refusal without words");
  } catch (const std::exception& error) {
    Abort(std::string("an exception that is not std::invalid_argument: ") + error.what());
  }
  return false;
}

std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (const std::string& robot : AllRobots()) {
    const RobotTexts texts = ReadRobotTexts(RobotFile(robot));
    seeds.push_back(texts.urdf + kYamlFollows + texts.yaml);
  }
  const std::string whole = seeds.front();
  seeds.push_back(whole.substr(0, whole.size() / 3));
  seeds.push_back(Replaced(whole, "<mass value=\"", "<mass value=\"0\" was=\""));
  seeds.push_back(Replaced(whole, "\"0\"", "\"nan\""));
  seeds.push_back(Replaced(whole, "stiffness: ", "stiffness: .nan #"));
  const std::string
      link = "<link name=\"a%\"/>",
      joint =
          "<joint name=\"j%\" type=\"floating\"><parent link=\"a%\"/><child link=\"a#\"/></joint>";
  const auto chain = [&](int count, int back_to) {
    std::string text = "<robot name=\"chain\">";
    for (int k = 0; k < count; ++k) {
      text += Replaced(link, "%", std::to_string(k));
      const bool last = k + 1 == count;
      if (last && back_to < 0) break;
      text += Replaced(Replaced(joint, "%", std::to_string(k)), "#",
                       std::to_string(last ? back_to : k + 1));
    }
    return text + "</robot>";
  };
  seeds.push_back(chain(5, 0));
  seeds.push_back(chain(5, 2));
  seeds.push_back(chain(990, -1));
  std::string million;
  for (int k = 0; k < 1000000; ++k) million += "<link/>";
  seeds.push_back("<robot>" + million.substr(0, kMaxUrdfBytes - 20) + "</robot>");
  seeds.push_back("<robot>" + million + "</robot>");
  seeds.push_back(std::string(kYamlFollows) + std::string(100000, '['));
  seeds.push_back(seeds.front().substr(0, seeds.front().find(kYamlFollows)) + kYamlFollows +
                  "constraints: &a {x: *a}\nefforts: *a\nnominal: *a");
  return seeds;
}

}  // namespace fuzz
}  // namespace contact_flow
