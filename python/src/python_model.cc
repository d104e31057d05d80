// SPDX-License-Identifier: BSD-3-Clause
// Models of one's own in Python: a MechanicalSystem that asks an object for its terms, which
// contact_flow/python_model.py makes of the user's formulas.
#include <functional>
#include <stdexcept>

#include "convert.h"

namespace contact_flow {
namespace python {
namespace {

/// A Python object that any thread may let go of.
std::shared_ptr<py::object> Hold(py::object object) {
  return {new py::object(std::move(object)), [](py::object* held) {
            const py::gil_scoped_acquire acquire;
            delete held;
          }};
}

/// Read-only: a formula that changed its arguments would change those of the next one.
py::array_t<double> Copy(const VectorRef& vector) {
  py::array_t<double> copy(vector.size(), vector.data());
  py::detail::array_proxy(copy.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return copy;
}

class PythonSystem final : public MechanicalSystem {
 public:
  /// From what `terms`, an instance of contact_flow.python_model.Terms, says of itself.
  explicit PythonSystem(const py::object& terms) : terms_(Hold(terms)) {
    using Names = std::vector<std::string>;
    description_.name = terms.attr("name").cast<std::string>();
    description_.summary = terms.attr("summary").cast<std::string>();
    description_.coordinates = description_.velocities = terms.attr("coordinates").cast<Names>();
    description_.units = terms.attr("units").cast<Names>();
    description_.constraints = terms.attr("constraints").cast<Names>();
    description_.bilateral = terms.attr("bilateral").cast<Names>();
    description_.inputs = terms.attr("inputs").cast<Names>();
    for (const auto& entry : terms.attr("parameter_list")) {
      const auto p = entry.cast<py::tuple>();
      description_.parameters.push_back({p[0].cast<std::string>(), p[1].cast<std::string>(),
                                         p[2].cast<std::string>(), p[3].cast<double>()});
    }
    for (const auto& is_circle : terms.attr("circles")) {
      space_.Append(is_circle.cast<bool>() ? ConfigurationSpace::Factor::kCircle
                                           : ConfigurationSpace::Factor::kLine);
    }
    compliant_ = ToContacts(terms.attr("compliant"), description_);
    contact_effort_ = terms.attr("contact_effort").cast<bool>();
    constant_mass_ = terms.attr("constant_mass").cast<bool>();
    affine_constraints_ = terms.attr("affine_constraints").cast<bool>();
    restitution_ = ToVector(terms.attr("restitution"), "restitution", num_constraints());
    nominal_.x = ToVector(terms.attr("nominal_x"), "nominal x", state_size());
    nominal_.u = ToVector(terms.attr("nominal_u"), "nominal u", num_inputs());
    nominal_.duration = terms.attr("nominal_duration").cast<double>();
  }

  bool HasConstantMass() const override { return constant_mass_; }
  bool HasAffineConstraints() const override { return affine_constraints_; }

  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override {
    const py::gil_scoped_acquire acquire;
    const py::tuple answer = Ask("dynamics", Copy(q), Copy(v), Copy(u), mode.Members().bits());
    if (mass != nullptr) Take(answer[0], "mass_matrix(q)", dof(), dof(), mass);
    Take(answer[1], "force(q, v, u)", dof(), force);
  }

  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override {
    const py::gil_scoped_acquire acquire;
    const py::tuple answer = Ask("constraint_terms", Copy(q), Copy(v));
    Take(answer[0], "gaps(q)", num_rows(), &terms->gap);
    Take(answer[1], "Dgaps(q)", num_rows(), dof(), &terms->jacobian);
    Take(answer[2], "D²gaps(q)", num_rows(), &terms->bias);
  }

  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* j) const override {
    const py::gil_scoped_acquire acquire;
    const py::tuple answer = Ask("differentiate_dynamics", Copy(q), Copy(v), Copy(u),
                                 mode.Members().bits(), Copy(acceleration), Copy(force));
    Take(answer[0], "∂r₁/∂q", dof(), dof(), &j->momentum_q);
    Take(answer[1], "∂r₁/∂v", dof(), dof(), &j->momentum_v);
    Take(answer[2], "∂r₁/∂u", dof(), num_inputs(), &j->momentum_u);
    Take(answer[3], "∂r₂/∂q", num_rows(), dof(), &j->constraint_q);
    Take(answer[4], "∂r₂/∂v", num_rows(), dof(), &j->constraint_v);
  }

  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* j) const override {
    const py::gil_scoped_acquire acquire;
    const py::tuple answer =
        Ask("differentiate_impact", Copy(q), Copy(jump), Copy(impulse), Copy(s));
    Take(answer[0], "∂r₁/∂q of the impact", dof(), dof(), &j->momentum_q);
    Take(answer[1], "∂r₂/∂q of the impact", num_rows(), dof(), &j->constraint_q);
  }

  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, const std::vector<int>& parameters,
                                         ParameterJacobian* j) const override {
    const py::gil_scoped_acquire acquire;
    const auto k = static_cast<Eigen::Index>(parameters.size());
    const py::tuple answer =
        Ask("differentiate_dynamics_by_parameters", Copy(q), Copy(v), Copy(u),
            mode.Members().bits(), Copy(acceleration), Copy(force), parameters);
    Take(answer[0], "∂r₁/∂p", dof(), k, &j->momentum);
    Take(answer[1], "∂r₂/∂p", num_rows(), k, &j->constraint);
  }

  void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       const std::vector<int>& parameters,
                                       ParameterJacobian* j) const override {
    const py::gil_scoped_acquire acquire;
    const auto k = static_cast<Eigen::Index>(parameters.size());
    const py::tuple answer = Ask("differentiate_impact_by_parameters", Copy(q), Copy(jump),
                                 Copy(impulse), Copy(s), parameters);
    Take(answer[0], "∂r₁/∂p of the impact", dof(), k, &j->momentum);
    Take(answer[1], "∂r₂/∂p of the impact", num_rows(), k, &j->constraint);
    Take(answer[2], "∂gaps/∂p", num_rows(), k, &j->gap);
    Take(answer[3], "∂restitution/∂p", num_constraints(), k, &j->restitution);
  }

 private:
  template <class... Arguments>
  py::tuple Ask(const char* method, Arguments&&... arguments) const {
    return terms_->attr(method)(std::forward<Arguments>(arguments)...);
  }
  void Take(const py::handle& value, const char* what, Eigen::Index size, Vector* vector) const {
    *vector = ToVector(value, (description_.name + "." + what).c_str(), size);
  }
  void Take(const py::handle& value, const char* what, Eigen::Index rows, Eigen::Index cols,
            Matrix* matrix) const {
    const std::string field = description_.name + "." + what;
    *matrix = ToMatrix(value, field.c_str(), cols);
    if (matrix->rows() != rows) {
      throw py::value_error(field + " has " + std::to_string(matrix->rows()) + " rows, expected " +
                            std::to_string(rows));
    }
  }

  std::shared_ptr<py::object> terms_;
  bool constant_mass_ = false;
  bool affine_constraints_ = false;
};

/// `make`(values) makes the terms; `formulas` is what a pickle needs beside the values.
class PythonModel : public System {
 public:
  PythonModel(const py::object& formulas, const py::object& make, const ParameterValues& values)
      : formulas_(Hold(formulas)), make_(Hold(make)) {
    system = Make(values);
  }
  std::unique_ptr<MechanicalSystem> Make(const ParameterValues& values) const override {
    const py::gil_scoped_acquire acquire;
    try {
      return std::make_unique<PythonSystem>((*make_)(*formulas_, values));
    } catch (py::error_already_set& error) {
      if (!error.matches(PyExc_ValueError)) throw;
      throw std::invalid_argument(py::str(error.value()).cast<std::string>());  // as models in C++
    } catch (const py::value_error& error) {
      throw std::invalid_argument(error.what());
    }
  }
  std::shared_ptr<System> With(const ParameterValues& values) const override {
    return std::make_shared<PythonModel>(*formulas_, *make_, values);
  }
  std::string Origin() const override {
    return "PythonModel '" + description().name + "' by " + differentiation();
  }
  py::object formulas() const { return *formulas_; }
  /// How its formulas are differentiated.
  std::string differentiation() const {
    return formulas_->attr("differentiation").cast<std::string>();
  }

 private:
  std::shared_ptr<py::object> formulas_;
  std::shared_ptr<py::object> make_;
};

py::object MakeTerms() {
  return py::module_::import("contact_flow.python_model").attr("make_terms");
}

}  // namespace

void BindPythonModel(py::module_* module) {
  py::class_<PythonModel, System, std::shared_ptr<PythonModel>>(
      *module, "PythonModel",
      "A model of one's own in Python: a subclass of contact_flow.Formulas, with values of its\n"
      "parameters. Its derivatives are forward duals through its formulas, or differences.")
      .def(py::init([](const py::object& formulas, const py::kwargs& parameters) {
             return std::make_shared<PythonModel>(formulas, MakeTerms(), ToParameters(parameters));
           }),
           py::arg("formulas"), py::pos_only())
      .def_property_readonly("formulas", &PythonModel::formulas, "The class.")
      .def_property_readonly("differentiation", &PythonModel::differentiation,
                             "'duals' or 'differences': how its formulas are differentiated.")
      .def(py::pickle([](const PythonModel& m) { return py::make_tuple(m.formulas(), m.Values()); },
                      [](const py::tuple& state) {
                        return std::make_shared<PythonModel>(state[0].cast<py::object>(),
                                                             MakeTerms(),
                                                             state[1].cast<ParameterValues>());
                      }));
}

}  // namespace python
}  // namespace contact_flow
