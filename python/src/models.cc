// SPDX-License-Identifier: BSD-3-Clause
// Systems that are made in C++: Model by its name, Robot from URDF and YAML.
#include "contact_flow/io/configuration.h"
#include "contact_flow/model/model_library.h"
#include "convert.h"
#include "robot.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

class Model : public System {
 public:
  Model(std::string name, const ParameterValues& values) : name_(std::move(name)) {
    system = Make(values);
  }
  std::unique_ptr<MechanicalSystem> Make(const ParameterValues& values) const override {
    return MakeModel(name_, values);
  }
  std::shared_ptr<System> With(const ParameterValues& values) const override {
    return std::make_shared<Model>(name_, values);
  }
  std::string Origin() const override { return "Model '" + name_ + "'"; }

 private:
  std::string name_;
};

/// "x.urdf" and "x.xacro" alone, everything else is a YAML.
bool IsUrdf(const std::string& path) {
  const std::string::size_type dot = path.rfind('.');
  const std::string ending = dot == std::string::npos ? "" : path.substr(dot);
  return ending == ".urdf" || ending == ".xacro" || ending == ".xml";
}

std::shared_ptr<Robot> FromFile(const py::object& path, const std::string& urdf,
                                const py::kwargs& parameters) {
  const std::string file = py::module_::import("os").attr("fspath")(path).cast<std::string>();
  const ParameterValues values = ToParameters(parameters);
  return WithoutLock([&] {
    const RobotTexts texts = IsUrdf(file) ? ReadUrdf(file) : ReadRobotTexts(file, urdf);
    return std::make_shared<Robot>(texts, values);
  });
}

std::shared_ptr<Robot> FromStrings(const std::string& urdf, const std::string& yaml,
                                   const std::string& folder, const py::kwargs& parameters) {
  const ParameterValues values = ToParameters(parameters);
  const std::string end = folder.empty() || folder.back() == '/' ? "" : "/";
  return WithoutLock([&] {
    return std::make_shared<Robot>(RobotTexts{urdf, yaml, "", folder + end}, values);
  });
}

/// A file of config/: (system, options of runs, options of derivatives).
py::tuple LoadConfigured(const py::object& path) {
  const Configuration c =
      LoadConfiguration(py::module_::import("os").attr("fspath")(path).cast<std::string>());
  return py::make_tuple(std::make_shared<Model>(c.model, c.parameters), ToDict(c.options),
                        ToDict(c.derivative_options));
}

}  // namespace

void BindModels(py::module_* module) {
  module->def("models", &ModelNames, "Names of all models in C++, sorted.");
  module->def("load_configuration", &LoadConfigured, py::arg("path"),
              "(system, options of simulate, options of derivative) from a YAML like those of "
              "config/.");

  py::class_<Model, System, std::shared_ptr<Model>>(
      *module, "Model",
      "A model in C++ by its name, with values of its parameters:\n\n"
      ">>> Model('soft_biped', stiffness=30).parameters['stiffness']\n30.0")
      .def(py::init([](const std::string& name, const py::kwargs& parameters) {
             const ParameterValues values = ToParameters(parameters);
             return std::make_shared<Model>(name, values);
           }),
           py::arg("name"), py::pos_only())
      .def(py::pickle(
          [](const Model& m) { return py::make_tuple(m.description().name, m.Values()); },
          [](const py::tuple& state) {
            return std::make_shared<Model>(state[0].cast<std::string>(),
                                           state[1].cast<ParameterValues>());
          }));

  py::class_<Robot, System, std::shared_ptr<Robot>>(
      *module, "Robot",
      "A robot from a YAML that names a URDF, or from a URDF (or xacro) alone. ValueError, with\n"
      "line or name, for what is wrong in them.")
      .def(py::init(&FromFile), py::arg("path"), py::arg("urdf") = "",
           "`urdf`: text or path, instead of the one that the YAML names.")
      .def_static("from_strings", &FromStrings, py::arg("urdf"), py::arg("yaml") = "",
                  py::arg("folder") = "", "From texts; `folder` is where meshes are sought.")
      .def_property_readonly(
          "urdf", [](const Robot& r) { return r.texts().urdf; }, "Its text.")
      .def_property_readonly(
          "yaml", [](const Robot& r) { return r.texts().yaml; }, "Its text.")
      .def_property_readonly(
          "warnings", [](const Robot& r) { return r.robot().model.warnings; },
          "What of the URDF is not used.")
      .def(py::pickle(
          [](const Robot& r) {
            const RobotTexts& t = r.texts();
            return py::make_tuple(t.urdf, t.yaml, t.path, t.folder, r.Values());
          },
          [](const py::tuple& state) {
            return std::make_shared<Robot>(
                RobotTexts{state[0].cast<std::string>(), state[1].cast<std::string>(),
                           state[2].cast<std::string>(), state[3].cast<std::string>()},
                state[4].cast<ParameterValues>());
          }));
  BindRobotPose(module);
}

}  // namespace python
}  // namespace contact_flow
