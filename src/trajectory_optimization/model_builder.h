// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {

/// Adds w r² with the derivative of r, of which few entries may differ from 0.
void AddSquare(double weight, double r, const Eigen::RowVectorXd& row, PieceModel* model);

/// A run with its derivative, from which the model of each choice of orders is built. The tangents
/// W [2d+m+p × n] of state, input and parameters by the unknowns are carried along the arcs, at
/// fixed times; what happens at an instant t_k that moves sees W + F δt_k.
class ModelBuilder {
 public:
  /// All of these must outlive it; `system` is that of y, `run` a Run or a RunBeyond.
  ModelBuilder(const Unknowns& unknowns, const MechanicalSystem& system, const Vector& y,
               const Multipliers& multipliers, const Trajectory& run,
               const BDerivative& derivative);

  /// How many choices there are, at most a million.
  std::size_t Count() const;
  /// The model of choice `number`, mixed radix in the orders; false with a status.
  bool Build(std::size_t number, PieceModel* model, Status* status);
  /// L of the run.
  double Cost() const;
  /// Those with several pieces, as sentences.
  std::vector<std::string> Clusters() const;

 private:
  // model_builder.cc: tangents and events.
  Matrix FirstTangents() const;
  void SetInput(std::size_t interval, Matrix* W) const;
  bool PassEvent(std::size_t k, const std::vector<int>& order, std::size_t* passed, Matrix* W,
                 PieceModel* model, Status* status);
  void PassChange(std::size_t k, std::size_t* passed, Matrix* W, PieceModel* model);
  void AddInput(std::size_t interval);
  void AddLabel(const EventMap& event, const std::vector<int>& order, PieceModel* model) const;
  void AddEvents(std::size_t k, const std::vector<int>& order, std::size_t instant, const Matrix& W,
                 const Eigen::RowVectorXd& shift);
  void AddLandings(std::size_t k, const Matrix& W);
  void AddOrders(PieceModel* model) const;
  void AddEnd(const Matrix& W, PieceModel* model);
  void AddNext(const Matrix& W);
  std::string AskedJump(std::size_t k, const EventMap& event) const;
  ConstraintSet JumpingAtEnd() const;
  bool AddCluster(const EventMap& event, const std::vector<int>& order, const Matrix& before,
                  const Matrix& after, std::size_t* passed, PieceModel* model,
                  Status* status) const;
  Vector FieldAt(std::size_t arc, bool end) const;

  // model_costs.cc: what they cost.
  void AddEffort(PieceModel* model) const;
  void AddState(std::size_t k, const Matrix& W, PieceModel* model) const;
  void AddCondition(std::size_t i, const Eigen::RowVectorXd& row, PieceModel* model) const;
  bool AddTouchdowns(PieceModel* model, Status* status) const;
  Matrix StateRates(const Vector& x, const Matrix& W) const;
  bool Asks(std::size_t k) const;

  // model_events.cc: costs by name.
  bool AddImpulses(std::size_t k, const std::vector<int>& order, std::size_t passed,
                   const Matrix& W, PieceModel* model, Status* status) const;
  bool AddRunning(PieceModel* model, Status* status) const;
  void AddPowerCurvature(PieceModel* model) const;
  void AddSlipCurvature(std::size_t arc, bool end, const Matrix& W, PieceModel* model) const;
  RunDirection Inside(const PieceModel& model) const;

  const Unknowns& unknowns_;
  const TrajectoryProblem& problem_;
  const MechanicalSystem& system_;
  const Vector& y_;
  const Multipliers& multipliers_;
  const Trajectory& run_;
  const BDerivative& derivative_;
  const Matrix states_;
  InputSchedule inputs_;
  Vector values_;                                      // of the conditions
  bool moves_ = false;                                 // instants of the grid may
  bool beyond_ = false;                                // the run goes on behind T
  std::vector<std::vector<std::vector<int>>> orders_;  // of each event map
  std::vector<EventTime> events_;
  std::map<int, int> occurrences_;
};

}  // namespace contact_flow
