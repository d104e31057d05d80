// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/robot_file.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/io/text_file.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "contact_flow/nearest_name.h"
#include "robot_fields.h"

namespace contact_flow {
namespace {

constexpr int kMaxConstraints = 64;  // that a ContactMode holds

/// Reads the kind of an element, which must be one of `kinds`.
std::string ReadKind(MapReader* reader, const std::vector<std::string>& kinds) {
  reader->Require("kind");
  int kind = 0;
  reader->Read("kind", kinds, &kind);
  return kinds[kind];
}

/// Calls read(name, reader) for each entry of a map of maps.
template <class Read>
void ForEach(const YAML::Node& map, const std::string& name, Read&& read) {
  MapReader outer(map, name);
  for (const std::string& key : outer.Keys()) {
    MapReader reader(outer.Child(key), name + "/" + key);
    read(key, &reader);
    reader.Finish();
  }
}

void ReadConstraints(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "constraints", [&](const std::string& name, MapReader* reader) {
    const std::string kind = ReadKind(reader, ConstraintKinds());
    std::unique_ptr<ConstraintElement> element = MakeConstraint(kind);
    element->parts.name = name;
    YamlFields fields(robot->model, reader, &robot->inputs, &element->parts);
    ReadConstraint(kind, &fields);
    Parameter& restitution = element->restitution;
    reader->Read("restitution", &restitution.value);
    try {
      CheckParameter(name, "restitution", restitution.value, Range::kUnitInterval);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(error.what() + reader->Line("restitution"));
    }
    robot->constraints.push_back(std::move(element));
  });
  if (robot->constraints.size() > kMaxConstraints) {
    throw std::invalid_argument("constraints: more than " + std::to_string(kMaxConstraints));
  }
}

void ReadClosures(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "closures", [&](const std::string& name, MapReader* reader) {
    ElementParts parts;
    parts.name = name;
    YamlFields fields(robot->model, reader, &robot->inputs, &parts);
    fields.Point("link", "point");
    fields.Point("other_link", "other_point");
    std::string axes = "xyz";
    reader->Read("axes", &axes);
    bool taken[3] = {};
    for (const char letter : axes) {
      const int axis = letter - 'x';
      if (axis < 0 || axis > 2 || taken[axis]) {
        throw std::invalid_argument("closures/" + name + "/axes is " + QuoteName(axes) +
                                    ", expected some of xyz, each once" + reader->Line("axes"));
      }
      taken[axis] = true;
      robot->closures.push_back(MakeClosureRow(parts.points[0], parts.points[1], axis));
      robot->closures.back()->parts.name = name + "_" + letter;
    }
    if (axes.empty()) throw std::invalid_argument("closures/" + name + "/axes is empty");
  });
}

void ReadEfforts(const YAML::Node& map, RobotDescription* robot) {
  ForEach(map, "efforts", [&](const std::string& name, MapReader* reader) {
    const std::string kind = ReadKind(reader, EffortKinds());
    std::unique_ptr<EffortElement> element = MakeEffort(kind);
    element->parts.name = name;
    YamlFields fields(robot->model, reader, &robot->inputs, &element->parts);
    ReadEffort(kind, &fields);
    robot->efforts.push_back(std::move(element));
  });
}

/// The range of a number that must be in both. (Zero, in the unit interval but not positive, is
/// then refused where it is set.)
Range Stricter(Range a, Range b) {
  for (const Range range : {Range::kUnitInterval, Range::kPositive, Range::kNonNegative}) {
    if (a == range || b == range) return range;
  }
  return Range::kAny;
}

void ReadParameters(const YAML::Node& map, RobotDescription* robot) {
  const std::vector<ExposedNumber> all = ListNumbers(*robot);
  std::vector<std::string> names;
  for (const ExposedNumber& number : all) names.push_back(number.parameter.name);
  MapReader reader(map, "parameters");
  for (const std::string& key : reader.Keys()) {
    std::vector<std::string> places;
    reader.Read(key, &places);
    if (places.empty()) {
      throw std::invalid_argument("parameters/" + key + " names no number" + reader.Line(key));
    }
    ExposedNumber exposed;
    for (const std::string& place : places) {
      const auto it = std::find(names.begin(), names.end(), place);
      if (it == names.end()) {
        throw std::invalid_argument("parameters/" + key + ": " +
                                    UnknownName("number", place, names) + reader.Line(key));
      }
      const ExposedNumber& found = all[it - names.begin()];
      if (exposed.places.empty()) {
        exposed = found;
        exposed.parameter.name = key;
        continue;
      }
      if (found.parameter.value != exposed.parameter.value) {
        throw std::invalid_argument("parameters/" + key + ": '" + place +
                                    "' is not equal to the numbers before it" + reader.Line(key));
      }
      exposed.range = Stricter(exposed.range, found.range);
      exposed.places.push_back(found.places[0]);
    }
    robot->parameters.push_back(exposed);
  }
}

/// Numbers by name into `values`, in the order of `names`.
void ReadNamed(const YAML::Node& map, const std::string& name,
               const std::vector<std::string>& names, double* values) {
  MapReader reader(map, name);
  for (std::size_t k = 0; k < names.size(); ++k) reader.Read(names[k], &values[k]);
  reader.Finish();
}

void ReadNominal(const YAML::Node& map, RobotDescription* robot) {
  const RobotModel& model = robot->model;
  const int positions = model.tree.num_positions(), n = model.tree.dof();
  MapReader reader(map, "nominal");
  Vector q = model.tree.Neutral(), v = Vector::Zero(n);
  robot->nominal.u = Vector::Zero(robot->inputs.size());
  ReadNamed(reader.Child("positions"), "nominal/positions", model.coordinates, q.data());
  ReadNamed(reader.Child("velocities"), "nominal/velocities", model.velocities, v.data());
  ReadNamed(reader.Child("inputs"), "nominal/inputs", robot->inputs, robot->nominal.u.data());
  reader.Read("duration", &robot->nominal.duration);
  if (!(robot->nominal.duration > 0)) {
    throw std::invalid_argument("nominal/duration is not positive" + reader.Line("duration"));
  }
  reader.Finish();
  for (const RigidBodyTree::Body& body : model.tree.bodies()) {
    if (body.joint != JointKind::kBall) continue;
    const double length = q.segment<4>(body.q).norm();
    if (!(std::abs(length - 1) < 1e-3)) {
      throw std::invalid_argument("nominal/positions: the quaternion from " +
                                  model.coordinates[body.q] + " has length " +
                                  std::to_string(length) + ", expected 1");
    }
    q.segment<4>(body.q) /= length;
  }
  robot->nominal.x.resize(positions + n);
  robot->nominal.x << q, v;
}

std::string ReadFile(const std::string& path) { return ReadTextFile(path, kMaxUrdfBytes); }

/// Folder of a path with its slash.
std::string FolderOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "" : path.substr(0, slash + 1);
}

/// Calls f, naming the file in what it throws.
template <class F>
auto InFile(const std::string& path, F&& f) {
  const std::string prefix = path.empty() ? "" : path + ": ";
  try {
    return f();
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument(prefix + error.what());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(prefix + error.what());
  }
}

/// Whether a text is XML rather than the path of a file.
bool IsXml(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  return first != std::string::npos && text[first] == '<';
}

/// A YAML document that is a map.
YAML::Node ParseYaml(const std::string& text) {
  if (text.size() > kMaxRobotYamlBytes) {
    throw std::invalid_argument("more than " + std::to_string(kMaxRobotYamlBytes) + " bytes");
  }
  const YAML::Node document = ParseYamlDocument(text);
  if (!document.IsMap()) throw std::invalid_argument("it is not a map of names to values");
  return document;
}

}  // namespace

RobotDescription ParseRobot(const std::string& urdf, const YAML::Node& document) {
  MapReader reader(document, "");
  std::string unused;
  reader.Read("urdf", &unused);
  int base = 0;
  reader.Read("base", RobotBaseNames(), &base);
  RobotDescription robot;
  robot.model = ParseUrdf(urdf, static_cast<RobotBase>(base));
  reader.Read("gravity", &robot.gravity);
  reader.Read("inputs", &robot.inputs);
  const std::size_t declared = robot.inputs.size();
  ReadConstraints(reader.Child("constraints"), &robot);
  ReadClosures(reader.Child("closures"), &robot);
  ReadEfforts(reader.Child("efforts"), &robot);
  if (reader.Has("inputs") && robot.inputs.size() > declared) {
    const std::vector<std::string> names(robot.inputs.begin(), robot.inputs.begin() + declared);
    throw std::invalid_argument(UnknownName("input", robot.inputs[declared], names));
  }
  ReadParameters(reader.Child("parameters"), &robot);
  ReadNominal(reader.Child("nominal"), &robot);
  reader.Finish();
  return robot;
}

RobotTexts ReadRobotTexts(const std::string& path, const std::string& urdf,
                          const std::string& usual) {
  RobotTexts texts;
  texts.path = path;
  texts.yaml = ReadFile(path);
  if (IsXml(urdf)) {
    texts.urdf = urdf;
  } else if (!urdf.empty()) {
    texts.urdf = ReadFile(urdf);
  } else {
    texts.urdf = InFile(path, [&] {
      MapReader reader(ParseYaml(texts.yaml), "");
      std::string file;
      if (!reader.Has("urdf") && !usual.empty()) return usual;
      reader.Require("urdf");
      reader.Read("urdf", &file);
      return ReadFile(file.substr(0, 1) == "/" ? file : FolderOf(path) + file);
    });
  }
  return texts;
}

RobotDescription ParseRobot(const RobotTexts& texts) {
  return InFile(texts.path, [&] { return ParseRobot(texts.urdf, ParseYaml(texts.yaml)); });
}

std::unique_ptr<RobotSystem> MakeRobot(const RobotTexts& texts, const ParameterValues& parameters) {
  RobotDescription robot = ParseRobot(texts);
  return InFile(texts.path,
                [&] { return std::make_unique<RobotSystem>(std::move(robot), parameters); });
}

std::unique_ptr<RobotSystem> LoadRobot(const std::string& path, const ParameterValues& parameters) {
  return MakeRobot(ReadRobotTexts(path), parameters);
}

}  // namespace contact_flow
