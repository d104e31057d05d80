// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "contact_flow/flow/error_tally.h"
#include "contact_flow/flow/stepper.h"
#include "lanes.h"

namespace contact_flow {

/// The step of one lane as that of a Stepper, for what looks at steps.
class LaneView final : public Stepper {
 public:
  explicit LaneView(LaneStepper* lanes, int n)
      : Stepper(n, -1.0 / 8, StagePlaces::OfDop853()),
        lanes_(lanes),
        field_(n),
        end_field_of_lane_(n) {
    begin_field_ = field_.data();
    end_field_ = end_field_of_lane_.data();
  }

  /// The end of the step that lane tried last, and its local errors.
  void LoadEnd(int lane) {
    const LaneArrays& a = lanes_->arrays();
    lane_ = lane;
    extended_ = false;
    h_ = a.h[lane];
    error_factor_ = a.factor[lane];
    Copy(a.end, &x_end_);
    Copy(a.errors, &errors_);
  }
  /// All of it.
  void Load(int lane) {
    const LaneArrays& a = lanes_->arrays();
    LoadEnd(lane);
    Copy(a.x, &x_);
    Copy(a.stages, &field_);
    Copy(a.stages + 12 * n_ * a.width, &end_field_of_lane_);
  }
  /// What the errors of the arc add up to, with those of this step.
  void LoadTally(int lane, ErrorTally* tally) {
    LoadEnd(lane);
    const Vector end = x_end_, errors = errors_;
    const double h = h_, factor = error_factor_;
    Copy(lanes_->arrays().tally, &errors_);
    x_end_.setZero();
    h_ = 0;
    error_factor_ = 1;
    tally->Reset();
    tally->AddStep(*this);
    x_end_ = end;
    errors_ = errors;
    h_ = h;
    error_factor_ = factor;
    tally->AddStep(*this);
  }
  /// The others are extended as well, as long as no other step is tried.
  void Extend() override {
    const LaneArrays& a = lanes_->arrays();
    if (!lanes_extended_) lanes_->Extend();
    lanes_extended_ = true;
    Copy(a.dense, &dense_);
    extended_ = true;
  }
  void ForgetExtension() { lanes_extended_ = false; }

  void Begin(const Vector&) override { Refuse(); }
  double GuessStep(double, double) override { return Refuse(); }
  double TryStep(double, double, double) override { return Refuse(); }
  void Finish() override { Refuse(); }
  void Advance() override { Refuse(); }

 private:
  [[noreturn]] static double Refuse() { throw std::logic_error("a view of a step takes none"); }
  void Copy(const double* from, Vector* to) const {
    const int width = lanes_->arrays().width;
    for (Eigen::Index i = 0; i < to->size(); ++i) (*to)(i) = from[i * width + lane_];
  }

  LaneStepper* const lanes_;
  int lane_ = 0;
  bool lanes_extended_ = false;
  Vector field_, end_field_of_lane_;
};

}  // namespace contact_flow
