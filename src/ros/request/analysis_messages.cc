// SPDX-License-Identifier: BSD-3-Clause
#include "analysis_messages.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "contact_flow/nearest_name.h"
#include "request.h"
#include "src/ros/message/conversions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr std::size_t kMaxPieces = 100000;
constexpr double kTight = 1e-12, kTightDerivative = 1e-11;
constexpr double kLargestMapTolerance = 1e-2;
constexpr int kMaxLinearPrograms = 100000000;
const char kRate[] = "d/dt ";

}  // namespace

std::vector<DerivativePiece> ToMsg(const PiecewiseLinearMap& map) {
  std::vector<DerivativePiece> pieces;
  for (const LinearPiece& piece : map.pieces()) pieces.push_back(ToMsg(piece));
  return pieces;
}

StabilityProof ToMsg(const StabilityCertificate& certificate) {
  StabilityProof m;
  m.test = static_cast<std::uint8_t>(certificate.test);
  m.bound = certificate.bound;
  m.norm = ToMsg(MatrixRef(certificate.norm));
  for (const std::vector<int>& word : certificate.words) {
    m.words.emplace_back();
    m.words.back().pieces.assign(word.begin(), word.end());
  }
  m.directions = ToMsg(MatrixRef(certificate.directions));
  return m;
}

Matrix ToMatrix(const std::string& field, const RowMajorMatrix& message) {
  const std::size_t rows = message.rows, cols = message.cols;
  if (message.data.size() != rows * cols) {
    throw std::invalid_argument(field + ".data has " + std::to_string(message.data.size()) +
                                " entries, expected " + std::to_string(rows) + " × " +
                                std::to_string(cols));
  }
  CheckFinite(field + ".data", message.data);
  const auto m = static_cast<Eigen::Index>(rows), n = static_cast<Eigen::Index>(cols);
  if (message.data.empty()) return Matrix(m, n);  // not by a loop over four billion rows of nothing
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(message.data.data(), m, n);
}

PiecewiseLinearMap ToMap(const std::string& field, const std::vector<DerivativePiece>& messages) {
  if (messages.size() > kMaxPieces) {
    throw std::invalid_argument(field + " has " + std::to_string(messages.size()) +
                                " pieces, at most " + std::to_string(kMaxPieces) + " are accepted");
  }
  std::vector<LinearPiece> pieces;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const std::string name = field + "[" + std::to_string(i) + "]";
    LinearPiece piece;
    piece.matrix = ToMatrix(name + ".matrix", messages[i].matrix);
    const bool same = i == 0 || (piece.matrix.rows() == pieces[0].matrix.rows() &&
                                 piece.matrix.cols() == pieces[0].matrix.cols());
    if (piece.matrix.size() == 0 || !same) {
      throw std::invalid_argument(name + ".matrix is " + std::to_string(piece.matrix.rows()) +
                                  " × " + std::to_string(piece.matrix.cols()) +
                                  ": it must not be empty, and of one size with the others");
    }
    piece.cone = Matrix(0, piece.matrix.cols());
    if (messages[i].cone.rows > 0) piece.cone = ToMatrix(name + ".cone", messages[i].cone);
    if (piece.cone.cols() != piece.matrix.cols()) {
      throw std::invalid_argument(name + ".cone has " + std::to_string(piece.cone.cols()) +
                                  " columns, the matrix " + std::to_string(piece.matrix.cols()));
    }
    for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
      const double length = piece.cone.row(r).stableNorm();
      if (!(length > 0)) {
        throw std::invalid_argument(name + ".cone: row " + std::to_string(r) +
                                    " is zero, which is no half-space");
      }
      piece.cone.row(r) /= length;
    }
    pieces.push_back(std::move(piece));
  }
  return PiecewiseLinearMap(std::move(pieces));
}

MapConsistencyOptions ResolveConsistency(double tolerance, std::uint32_t max_linear_programs,
                                         bool given, const Setup& setup) {
  MapConsistencyOptions options;
  options.tolerance =
      ResolveNumber("map_tolerance", tolerance, options.tolerance, kLargestMapTolerance);
  options.max_linear_programs =
      ResolveCount("max_linear_programs", max_linear_programs,
                   static_cast<int>(options.max_linear_programs), kMaxLinearPrograms);
  options.believe_undecided = !given;
  options.cancelled = setup.options.cancelled;
  return options;
}

MapConsistency CheckMap(const PiecewiseLinearMap& map, bool given, MapConsistencyOptions* options) {
  const MapConsistency found = CheckConsistency(map, *options);
  options->checked = true;
  if (!found.usable && given && found.defect != MapDefect::kUndecided) {
    throw std::invalid_argument("map: the pieces are not one continuous map: " + found.message);
  }
  return found;
}

StabilityCertificate ToCertificate(const std::string& field, const StabilityProof& proof) {
  if (proof.test > static_cast<int>(StabilityTest::kGrowingPlane)) {
    throw std::invalid_argument(field + ".test is " + std::to_string(proof.test) +
                                ", expected 0 to 7");
  }
  StabilityCertificate certificate;
  certificate.test = static_cast<StabilityTest>(proof.test);
  certificate.bound = proof.bound;
  certificate.norm = ToMatrix(field + ".norm", proof.norm);
  for (const PieceWord& word : proof.words) {
    certificate.words.emplace_back(word.pieces.begin(), word.pieces.end());
  }
  certificate.directions = ToMatrix(field + ".directions", proof.directions);
  return certificate;
}

int NameIndex(const std::string& field, const std::string& kind, const std::string& name,
              const std::vector<std::string>& valid) {
  const auto found = std::find(valid.begin(), valid.end(), name);
  if (found == valid.end()) {
    throw std::invalid_argument(field + ": " + UnknownName(kind, name, valid));
  }
  return static_cast<int>(found - valid.begin());
}

double ResolveNumber(const std::string& field, double asked, double standard, double largest) {
  CheckFinite(field, {asked});
  if (asked < 0 || asked > largest) {
    throw std::invalid_argument(field + " is " + std::to_string(asked) + ", expected 0 (" +
                                std::to_string(standard) + ") to " + std::to_string(largest));
  }
  return asked > 0 ? asked : standard;
}

int StateIndex(const std::string& field, const std::string& name,
               const SystemDescription& description) {
  const bool rate = name.compare(0, sizeof(kRate) - 1, kRate) == 0;
  if (!rate) return NameIndex(field, "coordinate", name, description.coordinates);
  return static_cast<int>(description.coordinates.size()) +
         NameIndex(field, "velocity", name.substr(sizeof(kRate) - 1), description.velocities);
}

SimulateOptions TightOptions(const Setup& setup) {
  SimulateOptions options = setup.options;
  options.relative_tolerance = std::min(options.relative_tolerance, kTight);
  options.absolute_tolerance = std::min(options.absolute_tolerance, kTight);
  return options;
}

BDerivativeOptions TightDerivativeOptions(const Setup& setup) {
  BDerivativeOptions options = setup.derivative_options;
  options.tolerance = std::min(options.tolerance, kTightDerivative);
  return options;
}

}  // namespace ros_interface
}  // namespace contact_flow
