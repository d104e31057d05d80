// SPDX-License-Identifier: BSD-3-Clause
// Systems whose inputs are led linearly through time.
#include "contact_flow/model/linear_inputs.h"

#include <memory>
#include <string>
#include <utility>

#include "convert.h"

namespace contact_flow {
namespace python {
namespace {

/// LinearInputs with the system that it leads.
class Led : public System {
 public:
  explicit Led(std::shared_ptr<System> base) : base_(std::move(base)) {
    led_ = std::make_shared<LinearInputs>(base_->system);
    system = led_;
  }
  std::unique_ptr<MechanicalSystem> Make(const ParameterValues& values) const override {
    return std::make_unique<LinearInputs>(
        std::shared_ptr<const MechanicalSystem>(base_->Make(values)));
  }
  std::shared_ptr<System> With(const ParameterValues& values) const override {
    return std::make_shared<Led>(base_->With(values));
  }
  std::string Origin() const override { return "LinearInputs of " + base_->Origin(); }

  const std::shared_ptr<System>& base() const { return base_; }
  const LinearInputs& led() const { return *led_; }

 private:
  std::shared_ptr<System> base_;
  std::shared_ptr<const LinearInputs> led_;
};

/// Rows (a, b, s) of the intervals between instants, at which the inputs are the rows of u.
Matrix Held(const Led& led, const py::object& t, const py::object& u) {
  const Vector times = ToVector(t, "t", -1);
  const Matrix nodes = ToMatrix(u, "u", led.base()->get().num_inputs());
  if (times.size() < 2 || nodes.rows() != times.size()) {
    throw py::value_error("t has " + std::to_string(times.size()) + " instants and u " +
                          std::to_string(nodes.rows()) +
                          " rows: as many are needed, and two at least");
  }
  Matrix held(times.size() - 1, led.get().num_inputs());
  for (Eigen::Index k = 0; k + 1 < times.size(); ++k) {
    const double length = times(k + 1) - times(k);
    if (!(length > 0)) {
      throw py::value_error("t[" + std::to_string(k + 1) + "] is not behind t[" +
                            std::to_string(k) + "]");
    }
    held.row(k) = LinearInputs::Held(times(k), length, nodes.row(k).transpose(),
                                     nodes.row(k + 1).transpose());
  }
  return held;
}

}  // namespace

void BindLinearInputs(py::module_* module) {
  py::class_<Led, System, std::shared_ptr<Led>>(
      *module, "LinearInputs",
      "A system whose inputs are led linearly through time, as one whose inputs are held:\n"
      "u = a + b (clock - s) with held inputs (a, b, s) [2m+1], and a coordinate more, a clock.")
      .def(py::init<std::shared_ptr<System>>(), py::arg("system"))
      .def_property_readonly("base", &Led::base, "The system that is led.")
      .def(
          "lead_state",
          [](const Led& led, const py::object& x, double clock) {
            return led.led().State(ToState(*led.base(), x), clock);
          },
          py::arg("x"), py::arg("clock") = 0.0,
          "(q, clock, v, 1) of a state x = (q, v) of the base.")
      .def("lead_inputs", &Held, py::arg("t"), py::arg("u"),
           "Held inputs of the intervals between instants t [K+1], at which the inputs of the\n"
           "base are the rows of u [K+1×m], as rows for a Grid of the first K instants.")
      .def(py::pickle([](const Led& led) { return py::make_tuple(led.base()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Led>(state[0].cast<std::shared_ptr<System>>());
                      }));
}

}  // namespace python
}  // namespace contact_flow
