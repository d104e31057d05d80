// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/trajectory_optimization/multiple_shooting.h"

namespace contact_flow {

/// A problem cut into segments: z = (y, states of the later segments), as tangents from where they
/// begin, and the rows of conditions and of what joins the segments.
class ShootingSegments {
 public:
  /// All must outlive it. Throws as OptimizeByShooting.
  ShootingSegments(const MechanicalSystem& system, const TrajectoryProblem& problem,
                   const ShootingOptions& shooting, std::size_t max_pieces);

  const Unknowns& whole() const { return whole_; }
  int count() const { return count_; }                   ///< of z
  std::size_t size() const { return segments_.size(); }  ///< how many segments
  int rows() const { return RowOfJoint(begins_.size()); }
  /// (row, column) of the entries of the derivative of the rows.
  std::vector<std::pair<int, int>> Pattern() const;
  /// J and the rows at z; false where a segment has none.
  bool Evaluate(const Vector& z, double* f, Vector* rows);
  /// Their derivatives, entries in the order of the pattern.
  bool Differentiate(const Vector& z, Vector* gradient, Vector* entries);
  /// Why there was no derivative.
  const std::string& reason() const { return reason_; }

  long simulations = 0;  ///< runs of segments so far
  long derivatives = 0;  ///< … with their derivative

 private:
  /// A part of the run, as a problem of its own; its end is asked for by conditions behind those
  /// that are given.
  struct Segment {
    TrajectoryProblem problem;
    std::unique_ptr<Unknowns> unknowns;
    std::vector<int> places;      // of its unknowns among all
    std::vector<int> conditions;  // rows of those of the whole
    int state = -1;               // place of its initial state, or −1
  };

  void Check() const;
  void PlaceSegments();
  void ChooseBegins(const Matrix& states);
  int Begin(std::size_t j) const { return j == 0 ? 0 : begins_[j - 1]; }
  int End(std::size_t j) const {
    return j < begins_.size() ? begins_[j] : static_cast<int>(problem_.inputs.grid.size());
  }
  bool IsLast(std::size_t j) const { return j == begins_.size(); }
  void AddSegment(std::size_t j, const Matrix& states);
  void Place(int begin, Segment* segment) const;
  Vector PartOf(const Segment& segment, const Vector& z) const;
  /// Rows: the conditions, then what joins each segment to the next.
  int RowOfJoint(std::size_t j) const {
    return static_cast<int>(problem_.conditions.size()) + static_cast<int>(j) * size_;
  }

  const MechanicalSystem& system_;
  const TrajectoryProblem& problem_;
  const ShootingOptions& shooting_;
  const std::size_t max_pieces_;
  const Unknowns whole_;
  const int size_;  // nq + d
  std::vector<int> begins_;
  std::vector<std::unique_ptr<Segment>> segments_;
  int count_ = 0;
  std::string reason_;
};

}  // namespace contact_flow
