// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/map_reader.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {

/// A model with its parameters and the settings of its runs: the content of a file of config/.
///
///     model: soft_biped
///     parameters: {stiffness: 27, …}           # names and units: the model's
///     options: {relative_tolerance: 1e-9, …}   # SimulateOptions, by field
///     derivative_options: {tolerance: 1e-9, …} # BDerivativeOptions, by field
///
/// Every key may be left out; an unknown one is an error.
struct Configuration {
  std::string model = "soft_biped";  ///< its name
  RobotTexts robot;                  ///< instead of a model, unless empty; not a key of the file
  ParameterValues parameters;        ///< values by name, over its defaults
  SimulateOptions options;           ///< of runs
  BDerivativeOptions derivative_options;  ///< of derivatives
};

/// The robot of the configuration, or else its model, with these values of its parameters.
std::unique_ptr<MechanicalSystem> MakeConfigured(const Configuration& configuration,
                                                 const ParameterValues& parameters);

/// Largest budgets that options may ask for.
inline constexpr long kMaxSteps = 1000000000;
inline constexpr long kMaxEvents = 1000000;      ///< of `options/max_events`
inline constexpr double kMaxSeconds = 3600;      ///< of `options/max_seconds` [s]
inline constexpr double kMaxMegabytes = 100000;  ///< of `options/max_megabytes` [MB]

/// Names of the impact laws, in the order of ImpactLaw.
const std::vector<std::string>& ImpactLawNames();
/// … and of the methods of integration, in the order of IntegrationMethod.
const std::vector<std::string>& IntegrationMethodNames();

/// Throws std::invalid_argument, naming option and value, unless every number is in its range.
/// Beyond Validate of the options of a run, the budgets are held to the largest ones above.
void CheckOptions(const SimulateOptions& options);
/// The same of a derivative's options.
void CheckOptions(const BDerivativeOptions& options);

/// Reads the four keys of a Configuration, on top of `base`, from a map that may have others, which
/// the caller reads.
Configuration ReadConfiguration(MapReader* reader, Configuration base = {});
/// The whole of a YAML document.
Configuration ParseConfiguration(const YAML::Node& document);
/// The whole of a file. Messages begin with its path; for malformed YAML they name the line.
Configuration LoadConfiguration(const std::string& path);

}  // namespace contact_flow
