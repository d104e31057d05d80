// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/configuration.h"

#include <sstream>
#include <stdexcept>

#include "contact_flow/io/text_file.h"

namespace contact_flow {
namespace {

ParameterValues ReadParameterValues(const YAML::Node& map, ParameterValues values) {
  MapReader reader(map, "parameters");
  for (const std::string& name : reader.Keys()) reader.Read(name, &values[name]);
  return values;
}

SimulateOptions ReadSimulateOptions(const YAML::Node& map, SimulateOptions o) {
  MapReader reader(map, "options");
  reader.Read("relative_tolerance", &o.relative_tolerance);
  reader.Read("absolute_tolerance", &o.absolute_tolerance);
  reader.Read("max_step", &o.max_step);
  reader.Read("simultaneity_tolerance", &o.simultaneity_tolerance);
  reader.Read("gap_tolerance", &o.gap_tolerance);
  reader.Read("speed_tolerance", &o.speed_tolerance);
  reader.Read("zeno_interval", &o.zeno_interval);
  reader.Read("complete_zeno", &o.complete_zeno);
  reader.Read("max_steps", &o.max_steps, 1, kMaxSteps);
  reader.Read("max_events", &o.max_events, 1, kMaxEvents);
  reader.Read("max_seconds", &o.max_seconds);
  reader.Read("max_megabytes", &o.max_megabytes);
  int law = static_cast<int>(o.impact_law);
  reader.Read("impact_law", ImpactLawNames(), &law);
  o.impact_law = static_cast<ImpactLaw>(law);
  int method = static_cast<int>(o.method);
  reader.Read("method", IntegrationMethodNames(), &method);
  o.method = static_cast<IntegrationMethod>(method);
  reader.Finish();
  CheckOptions(o);
  return o;
}

BDerivativeOptions ReadDerivativeOptions(const YAML::Node& map, BDerivativeOptions o) {
  MapReader reader(map, "derivative_options");
  reader.Read("tolerance", &o.tolerance);
  reader.Read("kink_tolerance", &o.kink_tolerance);
  long activations = o.max_activations_for_pieces;
  reader.Read("max_activations_for_pieces", &activations, 1, 10);
  o.max_activations_for_pieces = static_cast<int>(activations);
  long pieces = static_cast<long>(o.max_pieces);
  reader.Read("max_pieces", &pieces, 1, 1000000);
  o.max_pieces = static_cast<std::size_t>(pieces);
  reader.Finish();
  CheckOptions(o);
  return o;
}

void CheckWithin(const char* name, double value, double smallest, double largest) {
  if (value >= smallest && value <= largest) return;
  std::ostringstream text;
  text << name << " is " << value << ", expected " << smallest << " to " << largest;
  throw std::invalid_argument(text.str());
}

}  // namespace

std::unique_ptr<MechanicalSystem> MakeConfigured(const Configuration& configuration,
                                                 const ParameterValues& parameters) {
  if (configuration.robot.empty()) return MakeModel(configuration.model, parameters);
  return MakeRobot(configuration.robot, parameters);
}

const std::vector<std::string>& ImpactLawNames() {
  static const std::vector<std::string> names = {"complementarity", "projection"};
  return names;
}

const std::vector<std::string>& IntegrationMethodNames() {
  static const std::vector<std::string> names = {"explicit", "implicit", "automatic"};
  return names;
}

void CheckOptions(const SimulateOptions& options) {
  Validate(options);
  CheckWithin("options/max_steps", static_cast<double>(options.max_steps), 1, kMaxSteps);
  CheckWithin("options/max_events", static_cast<double>(options.max_events), 1, kMaxEvents);
  CheckWithin("options/max_seconds", options.max_seconds, 1e-3, kMaxSeconds);
  CheckWithin("options/max_megabytes", options.max_megabytes, 1e-3, kMaxMegabytes);
}

void CheckOptions(const BDerivativeOptions& options) {
  CheckWithin("derivative_options/tolerance", options.tolerance, 1e-14, 1e-2);
  CheckWithin("derivative_options/kink_tolerance", options.kink_tolerance, 1e-15, 1);
  CheckWithin("derivative_options/max_activations_for_pieces", options.max_activations_for_pieces,
              1, 10);
  CheckWithin("derivative_options/max_pieces", static_cast<double>(options.max_pieces), 1, 1e6);
}

Configuration ReadConfiguration(MapReader* reader, Configuration base) {
  Configuration& c = base;
  reader->Read("model", &c.model);
  c.parameters = ReadParameterValues(reader->Child("parameters"), c.parameters);
  c.options = ReadSimulateOptions(reader->Child("options"), c.options);
  c.derivative_options =
      ReadDerivativeOptions(reader->Child("derivative_options"), c.derivative_options);
  return base;
}

Configuration ParseConfiguration(const YAML::Node& document) {
  MapReader reader(document, "");
  Configuration configuration = ReadConfiguration(&reader);
  reader.Finish();
  return configuration;
}

Configuration LoadConfiguration(const std::string& path) {
  const std::string text = ReadTextFile(path, kMaxConfigurationBytes);
  try {
    if (text.size() > kMaxConfigurationBytes) {
      throw std::invalid_argument("more than " + std::to_string(kMaxConfigurationBytes) + " bytes");
    }
    return ParseConfiguration(ParseYamlDocument(text));
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument(path + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(path + ": " + error.what());
  }
}

}  // namespace contact_flow
