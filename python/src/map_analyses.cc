// SPDX-License-Identifier: BSD-3-Clause
// Maps to verdicts: stability with certificates, controllability, covariance.
#include "contact_flow/piecewise_linear/controllability.h"
#include "contact_flow/piecewise_linear/covariance.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using Map = PiecewiseLinearMap;

/// A report with the map that it is about, so that it can be verified.
struct Stability {
  Map map;
  StabilityReport report;
  StabilityOptions options;
  Question question;
};

const char* VerdictName(StabilityVerdict verdict) {
  switch (verdict) {
    case StabilityVerdict::kStable:
      return "stable";
    case StabilityVerdict::kUnstable:
      return "unstable";
    default:
      return "undetermined";
  }
}

const char* VerdictName(ControllabilityVerdict verdict) {
  switch (verdict) {
    case ControllabilityVerdict::kControllable:
      return "controllable";
    case ControllabilityVerdict::kNotControllable:
      return "not controllable";
    default:
      return "undetermined";
  }
}

void CheckSquare(const Map& map) {
  if (map.rows() == map.cols()) return;
  throw py::value_error("the map is " + std::to_string(map.rows()) + "×" +
                        std::to_string(map.cols()) + ", expected a square one");
}

Stability Assess(const Map& map, double margin, int max_word_length, long max_words,
                 long max_linear_programs) {
  CheckSquare(map);
  Stability stability;
  stability.map = map;
  stability.options.margin = margin;
  stability.options.max_word_length = max_word_length;
  stability.options.max_words = max_words;
  stability.options.max_linear_programs = max_linear_programs;
  stability.report = WithoutLock([&] { return AssessStability(map, stability.options); });
  stability.question = Question::Call(py::cast(map), "stability", margin, max_word_length,
                                      max_words, max_linear_programs);
  return stability;
}

void BindStability(py::module_* module) {
  py::class_<StabilityCertificate>(*module, "StabilityCertificate",
                                   "The data from which a verdict can be checked again.")
      .def_property_readonly(
          "test", [](const StabilityCertificate& c) { return StabilityTestName(c.test); },
          "What proves it: '1-norm', …")
      .def_readonly("bound", &StabilityCertificate::bound, "Factor of contraction or growth.")
      .def_readonly("norm", &StabilityCertificate::norm, "P or T [n×n].")
      .def_readonly("words", &StabilityCertificate::words,
                    "Indices of pieces in the order in which they are applied.")
      .def_readonly("directions", &StabilityCertificate::directions, "What grows [n×1 or n×2].")
      .def(PickledFields(&StabilityCertificate::test, &StabilityCertificate::bound,
                         &StabilityCertificate::norm, &StabilityCertificate::words,
                         &StabilityCertificate::directions))
      .def("__repr__", [](const StabilityCertificate& c) {
        return "<StabilityCertificate " + std::string(StabilityTestName(c.test)) + ", bound " +
               Number(c.bound) + ">";
      });
  py::class_<Stability> stability(*module, "Stability",
                                  "Whether x⁺ = f(x) is stable, with its proof.");
  PickleQuestion(&stability);
  stability
      .def_property_readonly(
          "verdict", [](const Stability& s) { return VerdictName(s.report.verdict); },
          "'stable', 'unstable' or 'undetermined'.")
      .def_property_readonly(
          "stable",
          [](const Stability& s) -> py::object {
            if (s.report.verdict == StabilityVerdict::kUndetermined) return py::none();
            return py::bool_(s.report.verdict == StabilityVerdict::kStable);
          },
          "True, False or None: nothing was proven.")
      .def_property_readonly(
          "message", [](const Stability& s) { return s.report.message; },
          "What decided, or why nothing did.")
      .def_property_readonly(
          "certificate", [](const Stability& s) { return s.report.certificate; }, "What proves it.")
      .def_property_readonly(
          "growth_below", [](const Stability& s) { return s.report.growth_below; },
          "Some y grows by this per step; 0: none was found.")
      .def_property_readonly(
          "growth_above", [](const Stability& s) { return s.report.growth_above; },
          "‖fᵏ(y)‖ ≤ c·growth_aboveᵏ‖y‖ for every y.")
      .def_property_readonly(
          "words", [](const Stability& s) { return s.report.words; }, "That were looked at.")
      .def_property_readonly(
          "map", [](const Stability& s) { return s.map; }, "The f that it is about.")
      .def(
          "verify",
          [](const Stability& s) {
            return WithoutLock(
                [&] { return VerifyCertificate(s.map, s.report.certificate, s.options); });
          },
          "Whether the certificate proves the verdict, from its data and the map's alone.")
      .def("__repr__", [](const Stability& s) { return "<Stability " + s.report.message + ">"; });
}

void BindControllability(py::module_* module) {
  using Report = ControllabilityReport;
  py::class_<Report>(*module, "Controllability",
                     "Whether a map from inputs to states is onto its reachable space.")
      .def_property_readonly(
          "verdict", [](const Report& r) { return VerdictName(r.verdict); },
          "'controllable', 'not controllable' or 'undetermined'.")
      .def_readonly("message", &Report::message, "Why, as a sentence.")
      .def_readonly("reachable", &Report::reachable,
                    "Orthonormal basis of what the pieces span together [r×k].")
      .def_readonly("restriction", &Report::restriction, "Basis of the inputs that suffice [m×k].")
      .def_readonly("pieces", &Report::pieces, "Of full dimension.")
      .def_readonly("coherently_oriented", &Report::coherently_oriented,
                    "All determinants have one sign.")
      .def_readonly("smallest_singular_ratio", &Report::smallest_singular_ratio,
                    "Of a piece: near 0 the sign of its determinant is hardly known.")
      .def_readonly("degree", &Report::degree,
                    "Sum of the signs of det over the preimages of a generic value.")
      .def_readonly("preimages", &Report::preimages, "Of a generic value.")
      .def_readonly("homeomorphism", &Report::homeomorphism,
                    "Coherently oriented, with one preimage.")
      .def_readonly("unattained", &Report::unattained, "A y [r] that no input attains, if found.")
      .def_readonly("twins", &Report::twins, "Two inputs with one value, if found.")
      .def(PickledFields(&Report::verdict, &Report::consistency, &Report::reachable,
                         &Report::restriction, &Report::pieces, &Report::coherently_oriented,
                         &Report::smallest_singular_ratio, &Report::degree, &Report::preimages,
                         &Report::homeomorphism, &Report::unattained, &Report::twins,
                         &Report::message))
      .def("__repr__", [](const Report& r) {
        return "<Controllability " + std::string(VerdictName(r.verdict)) + ": " + r.message + ">";
      });
}

void BindCovariance(py::module_* module) {
  py::class_<OutcomeCovariance>(*module, "Covariance", "First and second moments of f(w).")
      .def_property_readonly(
          "method", [](const OutcomeCovariance& c) { return CovarianceMethodName(c.method); },
          "'linear', 'truncation' (both exact) or 'cubature'.")
      .def_readonly("mean", &OutcomeCovariance::mean, "E f(w) [r]; not 0 where f is kinked.")
      .def_readonly("covariance", &OutcomeCovariance::covariance, "[r×r]")
      .def_readonly("mean_error", &OutcomeCovariance::mean_error, "Standard error; 0 where exact.")
      .def_readonly("covariance_error", &OutcomeCovariance::covariance_error,
                    "The same of the covariance.")
      .def_readonly("points", &OutcomeCovariance::points, "At which f was evaluated.")
      .def(PickledFields(&OutcomeCovariance::method, &OutcomeCovariance::mean,
                         &OutcomeCovariance::covariance, &OutcomeCovariance::mean_error,
                         &OutcomeCovariance::covariance_error, &OutcomeCovariance::points))
      .def("__repr__", [](const OutcomeCovariance& c) {
        return "<Covariance by " + std::string(CovarianceMethodName(c.method)) + ">";
      });
}

}  // namespace

void BindMapAnalyses(py::module_* module) {
  BindStability(module);
  BindControllability(module);
  BindCovariance(module);
  const StabilityOptions usual;
  py::class_<Map>(module->attr("PiecewiseLinearMap"))
      .def("stability", &Assess, py::arg("margin") = usual.margin,
           py::arg("max_word_length") = usual.max_word_length,
           py::arg("max_words") = usual.max_words,
           py::arg("max_linear_programs") = usual.max_linear_programs,
           "Whether x⁺ = f(x) is stable, as a Stability with a certificate; of a square map.")
      .def(
          "controllability",
          [](const Map& map) { return WithoutLock([&] { return AssessControllability(map); }); },
          "Whether f is onto its reachable space, as a Controllability.")
      .def(
          "covariance",
          [](const Map& map, const py::object& P, int rotations, unsigned seed) {
            CovarianceOptions options;
            options.rotations = rotations;
            options.seed = seed;
            const Matrix before = ToMatrix(P, "P", map.cols());
            return WithoutLock([&] { return PropagateCovariance(map, before, options); });
          },
          py::arg("P"), py::arg("rotations") = 1000, py::arg("seed") = 1,
          "Moments of f(w) for w normal with mean 0 and covariance P [n×n], as a Covariance.")
      .def(
          "worst_gain",
          [](const Map& map, int steps) {
            CheckSquare(map);
            return WithoutLock([&] { return WorstGain(map, steps); });
          },
          py::arg("steps"), "max ‖fᵏ(y)‖_∞ over ‖y‖_∞ ≤ 1; NaN where it is not known.");
}

}  // namespace python
}  // namespace contact_flow
