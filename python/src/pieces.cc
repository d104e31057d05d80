// SPDX-License-Identifier: BSD-3-Clause
// Piecewise-linear maps: matrices on cones, the form of every B-derivative.
#include "contact_flow/piecewise_linear/kink.h"
#include "contact_flow/piecewise_linear/map_consistency.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/piecewise_linear/section.h"
#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// From (matrix, cone) pairs; cone None: the whole space.
PiecewiseLinearMap FromPairs(const py::iterable& pairs) {
  std::vector<LinearPiece> pieces;
  for (const auto& pair : pairs) {
    LinearPiece piece;
    if (py::isinstance<LinearPiece>(pair)) {
      piece = pair.cast<LinearPiece>();
    } else {
      const auto items = py::reinterpret_borrow<py::sequence>(pair);
      if (!py::isinstance<py::sequence>(pair) || items.size() != 2) {
        throw py::type_error("a piece is a pair (matrix, cone)");
      }
      piece.matrix = ToMatrix(items[0], "matrix");
      piece.cone = items[1].is_none() ? Matrix(0, piece.matrix.cols())
                                      : ToMatrix(items[1], "cone", piece.matrix.cols());
    }
    if (piece.matrix.size() == 0) throw py::value_error("a piece has a matrix without entries");
    if (!piece.matrix.allFinite() || !piece.cone.allFinite()) {
      throw py::value_error("a piece has numbers that are not finite");
    }
    if (!pieces.empty() && (piece.matrix.rows() != pieces.front().matrix.rows() ||
                            piece.matrix.cols() != pieces.front().matrix.cols())) {
      throw py::value_error("the matrices of the pieces are not of one size");
    }
    for (Eigen::Index k = 0; k < piece.cone.rows(); ++k) {
      const double norm = piece.cone.row(k).stableNorm();
      if (norm == 0) throw py::value_error("a cone has a normal that is zero");
      piece.cone.row(k) /= norm;
    }
    pieces.push_back(std::move(piece));
  }
  if (pieces.empty()) throw py::value_error("a map needs one piece at least");
  return PiecewiseLinearMap(std::move(pieces));
}

py::object ApplyMap(const PiecewiseLinearMap& map, const py::object& w) {
  const Array array = ToArray(w, "w");
  if (array.ndim() < 2) return py::cast(map(ToVector(w, "w", map.cols())));
  const Matrix directions = ToMatrix(w, "w", map.cols());
  RowMajor values(directions.rows(), map.rows());
  for (Eigen::Index k = 0; k < directions.rows(); ++k) {
    values.row(k) = map(directions.row(k).transpose()).transpose();
  }
  return py::cast(values);
}

py::tuple PickledPiece(const LinearPiece& p) {
  return py::make_tuple(p.matrix, p.cone, p.omega, p.eta);
}

LinearPiece UnpickledPiece(const py::tuple& t) {
  LinearPiece piece;
  piece.matrix = ToMatrix(t[0], "matrix");
  piece.cone = ToMatrix(t[1], "cone");
  piece.omega = t[2].cast<std::vector<std::vector<std::string>>>();
  piece.eta = t[3].cast<std::vector<std::string>>();
  return piece;
}

void BindPiece(py::module_* module) {
  py::class_<LinearPiece>(*module, "LinearPiece",
                          "One linear selection: w ↦ matrix·w on the cone {w : cone·w ≥ 0}.")
      .def_property_readonly(
          "matrix",
          [](const py::object& self) { return View(self.cast<LinearPiece&>().matrix, self); },
          "[rows×cols], a read-only view.")
      .def_property_readonly(
          "cone", [](const py::object& self) { return View(self.cast<LinearPiece&>().cone, self); },
          "Half-spaces, one unit normal a row [h×cols]; no row: the whole space.")
      .def_readonly("omega", &LinearPiece::omega,
                    "The order of activations that selects it, one list a simultaneous cluster.")
      .def_readonly("eta", &LinearPiece::eta, "The contact modes passed through, as text.")
      .def(
          "margin",
          [](const LinearPiece& p, const py::object& w) {
            return p.Margin(ToVector(w, "w", p.matrix.cols()));
          },
          py::arg("w"), "Smallest cone·w; ≥ 0 inside.")
      .def(
          "contains",
          [](const LinearPiece& p, const py::object& w) {
            return p.Margin(ToVector(w, "w", p.matrix.cols())) >= 0;
          },
          py::arg("w"), "Whether w lies in the cone.")
      .def(py::pickle(&PickledPiece, &UnpickledPiece))
      .def("__repr__", [](const LinearPiece& p) {
        std::string text = "<LinearPiece " + std::to_string(p.matrix.rows()) + "×" +
                           std::to_string(p.matrix.cols()) + " on " +
                           std::to_string(p.cone.rows()) + " half-spaces";
        for (const auto& order : p.omega) text += ", " + Join(order);
        return text + ">";
      });
}

}  // namespace

void BindPieces(py::module_* module) {
  BindPiece(module);
  using Map = PiecewiseLinearMap;
  py::class_<Map>(*module, "PiecewiseLinearMap",
                  "A continuous, positively homogeneous map that is linear on each of finitely\n"
                  "many cones. Made of pairs (matrix, cone), cone None for the whole space.")
      .def(py::init(&FromPairs), py::arg("pieces"))
      .def_property_readonly(
          "shape", [](const Map& m) { return py::make_tuple(m.rows(), m.cols()); },
          "(length of a value, length of an argument).")
      .def_property_readonly("is_linear", &Map::IsLinear, "Whether there is one piece alone.")
      .def("__call__", &ApplyMap, py::arg("w"),
           "The value at w [cols] as [rows]; of each row of an array [k×cols] as [k×rows].")
      .def(
          "piece_at",
          [](const Map& m, const py::object& w) { return m.PieceAt(ToVector(w, "w", m.cols())); },
          py::arg("w"), "Index of the piece whose cone holds w best.")
      .def("__len__", [](const Map& m) { return m.pieces().size(); })
      .def(
          "__getitem__",
          [](const Map& m, py::ssize_t k) -> const LinearPiece& {
            const auto count = static_cast<py::ssize_t>(m.pieces().size());
            if (k < 0) k += count;
            if (k < 0 || k >= count) throw py::index_error("piece out of range");
            return m.pieces()[static_cast<std::size_t>(k)];
          },
          py::return_value_policy::reference_internal)
      .def(
          "__iter__",
          [](const Map& m) { return py::make_iterator(m.pieces().begin(), m.pieces().end()); },
          py::keep_alive<0, 1>())
      .def_property_readonly("kink", &Map::Kink,
                             "Largest entry of |A_i − A_1|: 0 where the map is linear after all.")
      .def(
          "after",
          [](const Map& m, const Map& inner, std::size_t max_pieces) {
            if (inner.rows() != m.cols()) {
              throw py::value_error("inner has " + std::to_string(inner.rows()) +
                                    " rows, expected " + std::to_string(m.cols()));
            }
            return WithoutLock([&] { return m.After(inner, max_pieces); });
          },
          py::arg("inner"), py::arg("max_pieces") = 100000, "self ∘ inner.")
      .def(
          "in_bases",
          [](const Map& m, const py::object& end, const py::object& start) {
            return InBases(m, ToMatrix(end, "end"), ToMatrix(start, "start"));
          },
          py::arg("end"), py::arg("start"), "z ↦ endᵀ f(start z), in orthonormal bases.")
      .def(
          "consistency",
          [](const Map& m) { return WithoutLock([&] { return CheckConsistency(m); }); },
          "Whether the pieces are one continuous map.")
      .def(
          "steepest_descent",
          [](const Map& m) {
            if (m.rows() != 1) throw py::value_error("the map has more than one row");
            const SteepestDescent s = WithoutLock([&] { return FindSteepestDescent(m); });
            return py::make_tuple(s.d, s.slope);
          },
          "(d [cols], slope) of a map of one row: min f(d) over |d|_∞ ≤ 1.")
      .def(py::pickle([](const Map& m) { return py::tuple(py::cast(m.pieces())); },
                      [](const py::tuple& t) { return Map(t.cast<std::vector<LinearPiece>>()); }))
      .def("__repr__", [](const Map& m) {
        return "<PiecewiseLinearMap " + std::to_string(m.rows()) + "×" + std::to_string(m.cols()) +
               " of " + std::to_string(m.pieces().size()) + " piece" +
               (m.pieces().size() == 1 ? "" : "s") + ">";
      });
  py::class_<MapConsistency>(*module, "MapConsistency", "Whether pieces are one continuous map.")
      .def_property_readonly("ok", &MapConsistency::ok, "Whether no defect was found.")
      .def("__bool__", &MapConsistency::ok)
      .def_property_readonly(
          "defect", [](const MapConsistency& c) { return MapDefectName(c.defect); },
          "'none', 'gap', 'overlap', 'jump', 'undecided'.")
      .def_readonly("message", &MapConsistency::message,
                    "Which pieces, where and by how much; empty when all is well.")
      .def_readonly("w", &MapConsistency::w, "Where it is seen.")
      .def_readonly("size", &MapConsistency::size, "Of a gap, or the relative jump.")
      .def(PickledFields(&MapConsistency::defect, &MapConsistency::first, &MapConsistency::second,
                         &MapConsistency::w, &MapConsistency::size,
                         &MapConsistency::linear_programs, &MapConsistency::message,
                         &MapConsistency::usable))
      .def("__repr__", [](const MapConsistency& c) {
        return "<MapConsistency " + std::string(MapDefectName(c.defect)) +
               (c.message.empty() ? ">" : ": " + c.message + ">");
      });
}

}  // namespace python
}  // namespace contact_flow
