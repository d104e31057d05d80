// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/robot_file.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/io/text_file.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "contact_flow/nearest_name.h"
#include "robot_fields.h"
#include "robot_parts.h"
#include "src/model/rigid_body/contact_friction.h"
#include "xacro.h"

namespace contact_flow {
namespace {

/// The constraints of a map; `where`, the line that asks for them, of those that were made.
void ReadConstraints(const YAML::Node& map, const std::string& where, RobotDescription* robot) {
  ForEach(map, "constraints", [&](const std::string& name, MapReader* reader) {
    for (const auto& other : robot->constraints) {
      if (other->parts.name != name) continue;
      throw std::invalid_argument("constraints/" + name +
                                  " is made by `contacts` or `joints`, too: rename it" +
                                  other->parts.where);
    }
    const std::string kind = ReadKind(reader, ConstraintKinds());
    std::unique_ptr<ConstraintElement> element = MakeConstraint(kind);
    element->parts.name = name;
    element->parts.where = where.empty() ? reader->Line("") : where;
    YamlFields fields(robot->model, reader, &robot->inputs, &element->parts);
    ReadConstraint(kind, &fields);
    if (kind == "stairs") CheckStairs(element->parts, *reader);
    if (reader->Has("motion")) element = ReadMotion(reader, robot->model, std::move(element));
    Parameter& restitution = element->restitution;
    reader->Read("restitution", &restitution.value);
    try {
      CheckParameter(name, "restitution", restitution.value, Range::kUnitInterval);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(error.what() + reader->Line("restitution"));
    }
    if (reader->Has("friction")) {
      const double friction = ReadFriction("constraints/" + name, reader);
      try {
        GiveFriction(robot->model, friction, element.get());
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("constraints/" + name + "/friction: " + error.what() +
                                    reader->Line("friction"));
      }
    }
    robot->constraints.push_back(std::move(element));
  });
}

void ReadNominal(const YAML::Node& map, const std::vector<std::string>& limited,
                 RobotDescription* robot) {
  const RobotModel& model = robot->model;
  const int positions = model.tree.num_positions(), n = model.tree.dof();
  MapReader reader(map, "nominal");
  Vector q = model.tree.Neutral(), v = Vector::Zero(n);
  CentreLimited(limited, model, &q);
  if (model.clock >= 0) v(model.ClockCoordinate().v) = 1;
  robot->nominal.u = Vector::Zero(robot->inputs.size());
  ReadNamed(reader.Child("positions"), "nominal/positions", model.coordinates, q.data());
  ReadNamed(reader.Child("velocities"), "nominal/velocities", model.velocities, v.data());
  if (model.clock >= 0 && v(model.ClockCoordinate().v) != 1) {
    throw std::invalid_argument("nominal/velocities/clock is not 1, the rate at which time passes" +
                                reader.Line("velocities"));
  }
  Follow(reader.Child("positions"), reader.Child("velocities"), model, &q, &v);
  ReadNamed(reader.Child("inputs"), "nominal/inputs", robot->inputs, robot->nominal.u.data());
  reader.Read("duration", &robot->nominal.duration);
  if (!(robot->nominal.duration > 0)) {
    throw std::invalid_argument("nominal/duration is not positive" + reader.Line("duration"));
  }
  reader.Finish();
  NormalizeQuaternions(model, "nominal/positions", reader.Line("positions"), &q);
  robot->nominal.x.resize(positions + n);
  robot->nominal.x << q, v;
}

/// What a robot's YAML may hold; `contacts_made` is written by KeepMeshContacts.
constexpr const char* kRobotKeys[] = {"urdf",
                                      "base",
                                      "urdf_faults",
                                      "gravity",
                                      "soles",
                                      "joints",
                                      "inputs",
                                      "efforts",
                                      "constraints",
                                      "contacts",
                                      "terrain",
                                      "contacts_made",
                                      "closures",
                                      "nominal",
                                      "parameters",
                                      "feedback",
                                      "gravity_compensation"};

/// Height of the lowest contact above the ground where the YAML does not say base_z [m].
constexpr double kDropHeight = 0.1;

/// The position that is the height of the robot: of its base, or of the floating joint that holds
/// it in the URDF; −1 where there is none.
int HeightPosition(const RobotModel& model) {
  const auto& names = model.coordinates;
  const auto base = std::find(names.begin(), names.end(), "base_z");
  if (base != names.end()) return static_cast<int>(base - names.begin());
  for (const RigidBodyTree::Body& body : model.tree.bodies()) {
    const bool upright = body.placement.rotation.isIdentity(1e-9);
    if (body.joint == JointKind::kTranslation && body.parent < 0 && upright) return body.q + 2;
  }
  return -1;
}

/// Puts a robot above the ground that contacts were made with, unless the YAML says where it is.
void Lift(const MadeContacts& made, const YAML::Node& nominal, RobotDescription* robot) {
  const int height = HeightPosition(robot->model);
  if (height < 0 || !std::isfinite(made.lowest)) return;
  const std::string& name = robot->model.coordinates[height];
  if (nominal.IsMap() && nominal["positions"] && nominal["positions"][name]) return;
  robot->nominal.x(height) += kDropHeight - made.lowest;
}

std::string ReadFile(const std::string& path) { return ReadTextFile(path, kMaxUrdfBytes); }

/// The text of a URDF whose file has this one, by way of xacro where it is one.
std::string ExpandUrdf(const std::string& path, const std::string& text) {
  return IsXacro(path, text) ? RunXacro(path) : text;
}

std::string ReadUrdfFile(const std::string& path) { return ExpandUrdf(path, ReadFile(path)); }

/// The URDF that a YAML names.
std::string ReadNamedUrdf(const std::string& path, const std::string& where) {
  std::string text;
  try {
    text = ReadFile(path);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("urdf: " + std::string(error.what()) + where);
  }
  return ExpandUrdf(path, text);
}

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
  if (!document.IsMap()) throw std::invalid_argument("it is not a map of names to values (line 1)");
  return document;
}

/// Refuses inputs of efforts that are not among the `declared` ones of the YAML, which come first.
void CheckInputs(const RobotDescription& robot, std::size_t declared) {
  if (robot.inputs.size() == declared) return;
  const std::vector<std::string> names(robot.inputs.begin(), robot.inputs.begin() + declared);
  const std::string unknown = UnknownName("input", robot.inputs[declared], names);
  for (const auto& effort : robot.efforts) {
    const std::vector<int>& inputs = effort->parts.inputs;
    if (std::find(inputs.begin(), inputs.end(), static_cast<int>(declared)) == inputs.end())
      continue;
    throw std::invalid_argument("efforts/" + effort->parts.name + ": " + unknown +
                                "; else add it to `inputs`" + effort->parts.where);
  }
  throw std::invalid_argument(unknown + "; else add it to `inputs`");
}

RobotModel ReadRobotModel(const std::string& urdf, const YAML::Node& document) {
  MapReader reader(document, "");
  int base = 0, faults = 0;
  reader.Read("base", RobotBaseNames(), &base);
  reader.Read("urdf_faults", UrdfFaultsNames(), &faults);
  return ParseUrdf(urdf, static_cast<RobotBase>(base), static_cast<UrdfFaults>(faults));
}

/// A map with more keys: behind its text, whose lines stay, where that is read so; a map in braces,
/// or with a mark of its end, is written anew.
std::string WithMore(const std::string& yaml, const YAML::Node& more) {
  const std::string longer = yaml + "\n" + YAML::Dump(more) + "\n";
  try {
    if (ParseYaml(longer).IsMap()) return longer;
  } catch (const std::invalid_argument&) {
  } catch (const YAML::Exception&) {
  }
  YAML::Node document = ParseYaml(yaml);
  for (const auto& entry : more) document[entry.first] = entry.second;
  return YAML::Dump(document) + "\n";
}

}  // namespace

void KeepMeshContacts(RobotTexts* texts) {
  try {
    const YAML::Node document = ParseYaml(texts->yaml);
    const bool filed = document["terrain"] && document["terrain"].IsScalar();
    if (!filed && texts->urdf.find("<mesh") == std::string::npos) return;
    if (document["contacts_made"]) return;
    RobotDescription robot;
    robot.model = ReadRobotModel(texts->urdf, document);
    AddSoles(document["soles"], &robot.model);
    AddBrakePads(document["joints"], &robot.model);
    const JointChoices joints = ReadJoints(document["joints"], &robot);
    const MadeContacts made = PlanContacts(document, texts->folder, robot.model, joints.limited);
    if (made.count == 0 && made.warnings.empty()) return;
    YAML::Node kept;
    kept["contacts_made"]["constraints"] = made.constraints;
    if (made.count > 0) kept["contacts_made"]["lowest"] = made.lowest;
    for (const std::string& warning : made.warnings) {
      kept["contacts_made"]["warnings"].push_back(warning);
    }
    texts->yaml = WithMore(texts->yaml, kept);
  } catch (const std::invalid_argument&) {  // told where the robot is made
  } catch (const YAML::Exception&) {
  }
}

RobotDescription ParseRobot(const std::string& urdf, const YAML::Node& document,
                            const std::string& folder) {
  MapReader reader(document, "");
  for (const char* key : kRobotKeys) reader.Child(key);
  reader.Finish();  // before what names something of a key that is misspelt
  RobotDescription robot;
  robot.model = ReadRobotModel(urdf, document);
  const YAML::Node springs = AddSoles(reader.Child("soles"), &robot.model);
  AddBrakePads(reader.Child("joints"), &robot.model);
  const bool moves = GroundMoves(document, folder);
  if (moves || FollowsTime(reader.Child("efforts"))) robot.model.AddClock();
  JointChoices joints = ReadJoints(reader.Child("joints"), &robot);
  reader.Read("gravity", &robot.gravity);
  if (robot.gravity < 0) {
    robot.model.warnings.push_back("gravity is negative and pulls upward: downward is positive" +
                                   reader.Line("gravity"));
  }
  ReadInputs(&reader, &robot.inputs);
  const std::size_t declared = robot.inputs.size();
  CheckSoledLinks(document["soles"], document["constraints"]);
  CheckSoles(document, robot.model);
  ReadConstraints(reader.Child("constraints"), "", &robot);
  const MadeContacts made = PlanContacts(document, folder, robot.model, joints.limited);
  ReadConstraints(made.constraints, reader.Line("contacts"), &robot);
  ReadConstraints(joints.constraints, reader.Line("joints"), &robot);
  for (auto& brake : joints.brakes) robot.constraints.push_back(std::move(brake));
  ConstraintCounts counts{made.count, static_cast<int>(joints.constraints.size()),
                          static_cast<int>(joints.brakes.size()), 0};
  if (moves) DriveClock(&robot);
  std::vector<std::string>* warnings = &robot.model.warnings;
  warnings->insert(warnings->end(), made.warnings.begin(), made.warnings.end());
  AddMimics(&robot);
  ReadClosures(reader.Child("closures"), &robot);
  ReadEfforts(reader.Child("efforts"), &robot);
  ReadEfforts(springs, &robot);
  ReadEfforts(joints.efforts, &robot);
  AddSwitches(&robot);
  counts.switches = static_cast<int>(robot.switches.size());
  CheckRoom(counts, document, &robot);
  ReadWeightShare(reader.Child("gravity_compensation"), &robot);
  if (reader.Has("inputs")) CheckInputs(robot, declared);
  ReadParameters(reader.Child("parameters"), &robot);
  ReadNominal(reader.Child("nominal"), joints.limited, &robot);
  if (made.count > 0) Lift(made, reader.Child("nominal"), &robot);
  ReadFeedback(reader.Child("feedback"), &robot);
  return robot;
}

RobotTexts ReadRobotTexts(const std::string& path, const std::string& urdf,
                          const std::string& usual) {
  RobotTexts texts;
  texts.path = path;
  texts.yaml = ReadFile(path);
  texts.folder = FolderOf(path);
  if (IsXml(urdf)) {
    texts.urdf = urdf;
  } else if (!urdf.empty()) {
    texts.folder = FolderOf(urdf);
    texts.urdf = ReadUrdfFile(urdf);
  } else {
    texts.urdf = InFile(path, [&] {
      MapReader reader(ParseYaml(texts.yaml), "");
      if (!reader.Has("urdf") && !usual.empty()) return usual;
      std::string file;
      reader.Require("urdf");
      reader.Read("urdf", &file);
      if (file.empty() || file[0] != '/') file = FolderOf(path) + file;
      texts.folder = FolderOf(file);
      return ReadNamedUrdf(file, reader.Line("urdf"));
    });
  }
  KeepMeshContacts(&texts);
  return texts;
}

RobotTexts ReadUrdf(const std::string& path) {
  RobotTexts texts;
  texts.folder = FolderOf(path);
  texts.urdf = ReadUrdfFile(path);
  return texts;
}

RobotDescription ParseRobot(const RobotTexts& texts) {
  return InFile(texts.path,
                [&] { return ParseRobot(texts.urdf, ParseYaml(texts.yaml), texts.folder); });
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
