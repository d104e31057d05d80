// SPDX-License-Identifier: BSD-3-Clause
// Sweeps: the request is a dict of plain values, which contact_flow/ensemble.py makes.
#include "contact_flow/ensemble/sweep.h"

#include <algorithm>

#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using Names = std::vector<std::string>;

/// A key of a dict, with its name in the message where it has another type.
template <class T>
T Get(const py::dict& dict, const char* key) {
  if (!dict.contains(key)) throw py::value_error(std::string("the request has no '") + key + "'");
  try {
    return dict[key].template cast<T>();
  } catch (const py::cast_error&) {
    throw py::type_error(std::string("'") + key + "' of the request is " +
                         py::repr(dict[key]).cast<std::string>() + ", which is of another kind");
  }
}

Vector GetVector(const py::dict& dict, const char* key, Eigen::Index size = -1) {
  return ToVector(Get<py::object>(dict, key), key, size);
}

DrawPart ToPart(const py::dict& dict) {
  static const Names kinds = {"grid", "uniform", "normal", "table"};
  DrawPart part;
  part.kind =
      static_cast<DrawPart::Kind>(IndexOf("kind of draw", Get<std::string>(dict, "kind"), kinds));
  part.names = Get<Names>(dict, "names");
  const auto n = static_cast<Eigen::Index>(part.names.size());
  if (part.kind == DrawPart::Kind::kGrid) {
    for (const auto& levels : Get<py::list>(dict, "levels")) {
      part.levels.push_back(ToVector(levels, "levels", -1));
    }
  } else if (part.kind == DrawPart::Kind::kUniform) {
    part.low = GetVector(dict, "low", n);
    part.high = GetVector(dict, "high", n);
  } else if (part.kind == DrawPart::Kind::kNormal) {
    part.mean = GetVector(dict, "mean", n);
    part.covariance = ToMatrix(Get<py::object>(dict, "covariance"), "covariance", n);
  } else {
    part.table = ToMatrix(Get<py::object>(dict, "table"), "table", n);
  }
  return part;
}

Keep ToKeep(const System& system, const py::dict& dict) {
  const MechanicalSystem& s = system.get();
  Keep keep;
  const auto names = Get<Names>(dict, "columns");
  static const Names known = {"outcome", "start",   "final_state", "end_time",
                              "words",   "margins", "jacobian"};
  for (const std::string& name : names) IndexOf("column", name, known);
  const auto has = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  keep.outcome = has("outcome");
  keep.start = has("start");
  keep.final_state = has("final_state");
  keep.end_time = has("end_time");
  keep.words = has("words");
  keep.margins = has("margins");
  keep.jacobian = has("jacobian");
  keep.events = Get<int>(dict, "events");
  const Vector samples = GetVector(dict, "samples");
  keep.samples.assign(samples.data(), samples.data() + samples.size());
  for (const auto& w : Get<py::list>(dict, "directions")) {
    keep.directions.push_back(ToVector(w, "directions", 2 * s.dof()));
  }
  for (const auto& item : Get<py::list>(dict, "costs")) {
    const auto cost = item.cast<py::dict>();
    keep.costs.push_back({Get<std::string>(cost, "name"), GetVector(cost, "target", s.state_size()),
                          GetVector(cost, "weight", s.state_size()),
                          GetVector(cost, "effort", s.num_inputs())});
  }
  keep.derivative =
      ToOptions(py::kwargs(Get<py::dict>(dict, "derivative_options")), BDerivativeOptions());
  return keep;
}

SweepRequest ToRequest(const std::shared_ptr<System>& system, const py::dict& dict) {
  SweepRequest request;
  request.system = system->system;
  request.make = [system](const ParameterValues& changes) {
    return system->Make(system->Values(changes));
  };
  request.x = GetVector(dict, "x0", system->get().state_size());
  const auto inputs = Get<py::dict>(dict, "inputs");
  const Vector grid = GetVector(inputs, "t");
  const Matrix values =
      ToMatrix(Get<py::object>(inputs, "u"), "inputs.u", system->get().num_inputs());
  if (values.rows() != grid.size()) throw py::value_error("inputs: t and u differ in length");
  for (Eigen::Index k = 0; k < grid.size(); ++k) {
    request.inputs.grid.push_back(grid(k));
    request.inputs.values.push_back(values.row(k).transpose());
  }
  request.duration = Get<double>(dict, "duration");
  request.options = ToOptions(py::kwargs(Get<py::dict>(dict, "options")), SimulateOptions());
  request.draws.seed = Get<std::uint64_t>(dict, "seed");
  request.draws.sobol = Get<bool>(dict, "sobol");
  for (const auto& part : Get<py::list>(dict, "parts")) {
    request.draws.parts.push_back(ToPart(part.cast<py::dict>()));
  }
  request.keep = ToKeep(*system, Get<py::dict>(dict, "keep"));
  const Names observables = ObservableNames(system->get(), request.keep);
  for (const auto& item : Get<py::list>(dict, "histograms")) {
    const auto axis = item.cast<py::dict>();
    request.histograms.push_back(
        {IndexOf("observable", Get<std::string>(axis, "name"), observables),
         Get<double>(axis, "low"), Get<double>(axis, "high"), Get<int>(axis, "bins")});
  }
  return request;
}

template <class T>
py::array ToColumn(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), kept->data(), owner);
}

py::dict SweepAnswer(SweepResult result) {
  Columns& c = result.columns;
  const auto rows = static_cast<py::ssize_t>(c.rows);
  py::dict columns;
  if (!c.outcome.empty() || rows == 0) {
    columns["outcome"] = ToColumn(std::move(c.outcome), {rows});
    columns["num_events"] = ToColumn(std::move(c.num_events), {rows});
  }
  if (!c.derivative_outcome.empty()) {
    columns["derivative_outcome"] = ToColumn(std::move(c.derivative_outcome), {rows});
  }
  if (!c.words.empty()) {
    std::vector<char> text(c.rows * kMaxWord, 0);
    for (std::size_t k = 0; k < c.rows; ++k) {
      std::copy(c.words[k].begin(), c.words[k].end(), text.begin() + k * kMaxWord);
    }
    columns["words"] =
        py::array(py::dtype("S" + std::to_string(kMaxWord)), {rows}, {}, text.data());
  }
  for (Columns::Real& column : c.reals) {
    std::vector<py::ssize_t> shape = {rows};
    for (std::size_t size : column.shape) shape.push_back(static_cast<py::ssize_t>(size));
    columns[column.name.c_str()] = ToColumn(std::move(column.values), std::move(shape));
  }
  py::dict answer;
  answer["status"] = py::cast(result.status);
  answer["columns"] = columns;
  answer["tally"] = py::cast(std::move(result.tally));
  answer["reference"] = py::cast(result.reference);
  answer["elapsed"] = result.progress.elapsed;
  return answer;
}

py::dict ToNamedCounts(const std::map<int, std::uint64_t>& outcomes) {
  py::dict counts;
  for (const auto& [outcome, count] : outcomes) counts[RunOutcomeName(outcome).c_str()] = count;
  return counts;
}

py::dict RunSweep(const std::shared_ptr<System>& system, const py::dict& dict, std::uint64_t first,
                  std::uint64_t count, int threads, double max_megabytes, double max_seconds,
                  const py::object& progress, double every) {
  SweepRequest request = ToRequest(system, dict);
  request.first = first;
  request.count = count;
  request.threads = threads;
  request.max_megabytes = max_megabytes;
  request.progress_every = every;
  if (!progress.is_none()) {
    request.progress = [&progress](const SweepProgress& p) {
      const py::gil_scoped_acquire acquire;
      progress(p.done, p.total, p.elapsed, ToNamedCounts(p.outcomes));
    };
  }
  SweepResult result = WithoutLock([&] { return Sweep(request); }, max_seconds);
  return SweepAnswer(std::move(result));
}

/// The one of this index, or IndexError.
template <class T>
const T& At(const std::vector<T>& all, std::size_t index, const char* field) {
  if (index < all.size()) return all[index];
  throw py::index_error(std::string(field) + " is " + std::to_string(index) + ", there are " +
                        std::to_string(all.size()));
}

void BindSummary(py::module_* module) {
  py::class_<Summary>(
      *module, "Summary",
      "Counts and statistics of runs. Observables are the final state as a tangent at the\n"
      "reference (velocities, then their rates), then costs, of the runs with outcome 'ok'.")
      .def_readonly("runs", &Summary::runs, "All of them.")
      .def_readonly("measured", &Summary::measured, "Those with outcome 'ok'.")
      .def_property_readonly(
          "outcomes", [](const Summary& s) { return ToNamedCounts(s.outcomes); },
          "Runs by outcome; 'inadmissible' and 'threw' are those of a sweep.")
      .def_property_readonly(
          "examples",
          [](const Summary& s) {
            py::dict examples;
            for (const auto& [outcome, example] : s.examples) {
              examples[RunOutcomeName(outcome).c_str()] =
                  py::make_tuple(example.first, example.second);
            }
            return examples;
          },
          "Of each outcome but 'ok' the first run, and why it came out so.")
      .def_readonly("words", &Summary::words, "Runs by mode word, as 'oo>lo>ll'.")
      .def_readonly("other_words", &Summary::other_words, "Runs with words that are not listed.")
      .def_readonly("mean", &Summary::mean, "[r]")
      .def_property_readonly("covariance", &Summary::Covariance, "[r×r], with n − 1.")
      .def_readonly("smallest", &Summary::smallest, "[r]")
      .def_readonly("largest", &Summary::largest, "[r]")
      .def(
          "quantile",
          [](const Summary& s, std::size_t observable, double p) {
            if (!(p >= 0 && p <= 1)) {
              throw py::value_error("p is " + std::string(py::str(py::float_(p))) +
                                    ", expected a number in [0, 1]");
            }
            return At(s.sketches, observable, "observable").Quantile(p);
          },
          py::arg("observable"), py::arg("p"),
          "The value below which the share p of the measured runs lies, by a sketch;\n"
          "exact up to 1024 runs. `observable` is its index.")
      .def(
          "rank_error",
          [](const Summary& s, std::size_t observable) {
            const QuantileSketch& sketch = At(s.sketches, observable, "observable");
            return sketch.count() == 0 ? 0.0
                                       : static_cast<double>(sketch.RankError()) /
                                             static_cast<double>(sketch.count());
          },
          py::arg("observable"),
          "By which share of the runs the rank of a quantile may be off at most;\n"
          "mostly it is off by a tenth of that.")
      .def(
          "histogram",
          [](const Summary& s, std::size_t index) {
            const HistogramAxis& axis = At(s.axes, index, "index");
            return py::make_tuple(axis.observable, axis.low, axis.high,
                                  At(s.histograms, index, "index"));
          },
          py::arg("index"),
          "(observable, low, high, counts) of the histogram with this index;\n"
          "the first count is of what is below `low`, the last of what is not below `high`.")
      .def(py::pickle(
          [](const Summary& s) {
            Tally alone;
            alone.Add(0, s);
            return py::bytes(alone.ToBytes());
          },
          [](const py::bytes& bytes) { return Tally::FromBytes(std::string(bytes)).Total(); }))
      .def("__repr__", [](const Summary& s) {
        return "<Summary of " + std::to_string(s.runs) + " runs, " + std::to_string(s.measured) +
               " measured>";
      });
}

}  // namespace

void BindSweep(py::module_* module) {
  BindSummary(module);
  py::class_<Tally>(*module, "Tally",
                    "Summaries of blocks of 256 runs, merged along one tree, so that the bits do\n"
                    "not depend on who had run which block when.")
      .def(py::init<>())
      .def("merge", &Tally::Merge, py::arg("other"),
           "Adds all that another one holds.\n\n"
           "ValueError, with nothing added, where both have a block.")
      .def("total", &Tally::Total, "All of it, as a Summary.\n\nA copy.")
      .def(
          "to_bytes", [](const Tally& tally) { return py::bytes(tally.ToBytes()); },
          "As bytes, with a checksum.\n\nThe same runs give the same bytes.")
      .def_static(
          "from_bytes", [](const py::bytes& bytes) { return Tally::FromBytes(std::string(bytes)); },
          py::arg("data"), "From to_bytes().\n\nValueError for bytes that are damaged.")
      .def(py::pickle([](const Tally& tally) { return py::bytes(tally.ToBytes()); },
                      [](const py::bytes& bytes) { return Tally::FromBytes(std::string(bytes)); }))
      .def("__repr__", [](const Tally& tally) {
        return "<Tally of " + std::to_string(tally.Total().runs) + " runs>";
      });
  module->def("_sweep", &RunSweep, py::arg("system"), py::arg("request"), py::arg("first"),
              py::arg("count"), py::arg("threads"), py::arg("max_megabytes"),
              py::arg("max_seconds"), py::arg("progress"), py::arg("every"));
  module->def("_check_sweep", [](const std::shared_ptr<System>& system, const py::dict& dict) {
    const SweepRequest request = ToRequest(system, dict);
    return py::make_tuple(ObservableNames(system->get(), request.keep),
                          Sampler(request.draws).names(), Sampler(request.draws).period(),
                          Sampler(request.draws).IsRandom());
  });
  module->def("_draw_sweep", [](const std::shared_ptr<System>& system, const py::dict& dict,
                                std::uint64_t first, std::uint64_t count) {
    const Sampler sampler(ToRequest(system, dict).draws);
    Matrix all(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(sampler.names().size()));
    Vector one;
    for (std::uint64_t k = 0; k < count; ++k) {
      sampler.Draw(first + k, &one);
      all.row(static_cast<Eigen::Index>(k)) = one.transpose();
    }
    return all;
  });
  module->def("_start_of", [](const std::shared_ptr<System>& system, const py::object& x0,
                              const py::object& inputs) {
    const InputSchedule schedule = ToSchedule(*system, inputs);
    Matrix values(schedule.values.size(), system->get().num_inputs());
    for (std::size_t k = 0; k < schedule.values.size(); ++k) {
      values.row(static_cast<Eigen::Index>(k)) = schedule.values[k].transpose();
    }
    return py::make_tuple(ToState(*system, x0), schedule.grid, values);
  });
  module->def("_ok_status", [] { return Status(); });
  module->def("_budget_status", [](const std::string& why) {
    return Status{Outcome::kBudgetExceeded, why};
  });
  module->def("_outcome_name", &RunOutcomeName);
  module->def("_options_of", [](const py::kwargs& options) {
    return ToDict(ToOptions(options, SimulateOptions()));
  });
}

}  // namespace python
}  // namespace contact_flow
