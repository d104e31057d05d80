// SPDX-License-Identifier: BSD-3-Clause
// One row of the table of scripts/robots_corpus: loads a URDF, drops it for half a second, and
// compares its derivative with one-sided difference quotients.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <random>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One line without tabs.
std::string OneLine(std::string text) {
  for (char& letter : text) {
    if (letter == '\n' || letter == '\t') letter = ' ';
  }
  return text.substr(0, 300);
}

/// A posture and a tilt without symmetry, small enough for every joint.
Vector Disturbed(const RobotSystem& system, double size, int seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Vector w = Vector::Zero(2 * system.dof());
  const bool closed = !system.description().bilateral.empty();
  for (int j = 0; j < system.dof(); ++j) {
    const std::string& name = system.description().velocities[j];
    const bool base = name.compare(0, 5, "base_") == 0;
    const bool height = name == "base_z";
    if (!height && (base || !closed)) w(j) = size * uniform(generator);
  }
  return system.Perturb(system.nominal().x, w);
}

std::string Derivative(const RobotSystem& system, const Trajectory& run, const Vector& x,
                       double duration, const SimulateOptions& options) {
  const BDerivative B = DifferentiateOutcome(system, run);
  if (!B.status.ok()) return "refused: " + OneLine(B.status.message);
  Vector w = Vector::Zero(2 * system.dof());
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  const bool closed = !system.description().bilateral.empty();
  for (int j = 0; j < system.dof(); ++j) {
    if (!closed || system.description().velocities[j].compare(0, 5, "base_") == 0) {
      w(j) = normal(generator);
    }
  }
  w.normalize();
  // A hand that falls on its fingers has derivatives of 1e9: smaller and smaller perturbations.
  const QuotientReport report =
      CompareWithQuotients(system, x, system.nominal().u, duration, w, B(w),
                           {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}, options, B.Error(w).maxCoeff());
  if (report.samples.empty() || !report.samples.back().status.ok()) {
    return "a perturbed run ended: " +
           (report.samples.empty() ? "" : OneLine(report.samples.back().status.message));
  }
  double error = report.samples.back().error;
  for (const QuotientSample& sample : report.samples) {
    if (sample.status.ok()) error = std::min(error, sample.error);
  }
  char text[80];
  std::snprintf(text, sizeof text, "slope %.3f error %.1e of %.1e", report.slope, error,
                B(w).cwiseAbs().maxCoeff());
  return text;
}

int Run(int count, char** words) {
  if (count < 2) {
    std::cerr << "usage: robot_trial FILE.urdf [floating|fixed] [seconds] [seed]\n";
    return 2;
  }
  const std::string file = words[1];
  const double duration = count > 3 ? std::stod(words[3]) : 0.5;
  const int seed = count > 4 ? std::stoi(words[4]) : 1;
  std::string base = count > 2 ? words[2] : "floating";
  const auto row = [&](const std::string& text) { std::cout << file << "\t" << text << std::endl; };
  try {
    const auto start = Clock::now();
    const RobotTexts texts = ReadUrdf(file);
    YAML::Node document;
    document["base"] = base;
    RobotDescription robot = ParseRobot(texts.urdf, document, texts.folder);
    const std::size_t warnings = robot.model.warnings.size();
    const RobotSystem system(std::move(robot), {});
    const double load = Since(start);
    char text[200];
    std::snprintf(text, sizeof text,
                  "loaded\t%s\t%d bodies\t%d dof\t%d contacts\t%zu warnings\t%.3f s", base.c_str(),
                  system.robot().model.tree.num_bodies(), system.dof(), system.num_constraints(),
                  warnings, load);
    SimulateOptions options;
    options.complete_zeno = true;
    options.max_seconds = 60;
    const Vector x = Disturbed(system, 0.01, seed);
    const auto begin = Clock::now();
    const Trajectory run = Simulate(system, x, system.nominal().u, duration, options);
    std::string outcome =
        run.status.ok() ? "ran to its end" : "ended: " + OneLine(run.status.message);
    outcome += "\t" + std::to_string(run.transitions.size()) + " events\t" +
               std::to_string(Since(begin)) + " s";
    row(std::string(text) + "\t" + outcome + "\t" +
        (run.status.ok() ? Derivative(system, run, x, duration, options) : "-"));
  } catch (const std::exception& error) {
    row("refused\t" + OneLine(error.what()));
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace contact_flow

int main(int count, char** words) { return contact_flow::Run(count, words); }
