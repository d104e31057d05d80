// SPDX-License-Identifier: BSD-3-Clause
#include "cvodes_solver.h"

#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace contact_flow {
namespace benchmark {
namespace {

constexpr int kDof = kStates / 2;
constexpr long kMaxSteps = 1000000;

void Check(int flag, const char* call) {
  if (flag < 0) {
    throw std::runtime_error(std::string("CVODES: ") + call + " returns " + std::to_string(flag));
  }
}

}  // namespace

CvodesSolver::CvodesSolver(const Scenario& scenario, bool sensitivities)
    : scenario_(scenario),
      with_sensitivities_(sensitivities),
      hybrid_(scenario),
      roots_(hybrid_.num_constraints()),
      rates_(hybrid_.num_constraints()) {
  Check(SUNContext_Create(nullptr, &context_), "SUNContext_Create");
  state_ = N_VNew_Serial(kStates, context_);
  std::copy(scenario_.x.data(), scenario_.x.data() + kStates, state());
  memory_ = CVodeCreate(CV_ADAMS, context_);
  Check(CVodeInit(memory_, Field, 0, state_), "CVodeInit");
  Check(CVodeSetUserData(memory_, this), "CVodeSetUserData");
  Check(CVodeSStolerances(memory_, 1e-6, 1e-6), "CVodeSStolerances");
  Check(CVodeSetMaxNumSteps(memory_, kMaxSteps), "CVodeSetMaxNumSteps");
  solver_ = SUNNonlinSol_FixedPoint(state_, 0, context_);
  Check(CVodeSetNonlinearSolver(memory_, solver_), "CVodeSetNonlinearSolver");
  Check(CVodeRootInit(memory_, hybrid_.num_constraints(), Gaps), "CVodeRootInit");
  std::fill(roots_.begin(), roots_.end(), -1);
  Check(CVodeSetRootDirection(memory_, roots_.data()), "CVodeSetRootDirection");
  if (!with_sensitivities_) return;
  sensitivities_ = N_VCloneVectorArray(kStates, state_);
  for (int k = 0; k < kStates; ++k) sensitivity(k) = Vector::Unit(kStates, k);
  Check(CVodeSensInit(memory_, kStates, CV_STAGGERED, SensitivityField, sensitivities_),
        "CVodeSensInit");
  std::vector<double> absolute(kStates, 1e-6);
  Check(CVodeSensSStolerances(memory_, 1e-6, absolute.data()), "CVodeSensSStolerances");
  Check(CVodeSetSensErrCon(memory_, SUNTRUE), "CVodeSetSensErrCon");
  sensitivity_solver_ = SUNNonlinSol_FixedPointSens(kStates, state_, 0, context_);
  Check(CVodeSetNonlinearSolverSensStg(memory_, sensitivity_solver_),
        "CVodeSetNonlinearSolverSensStg");
}

CvodesSolver::~CvodesSolver() {
  CVodeFree(&memory_);
  SUNNonlinSolFree(solver_);
  if (with_sensitivities_) {
    SUNNonlinSolFree(sensitivity_solver_);
    N_VDestroyVectorArray(sensitivities_, kStates);
  }
  N_VDestroy(state_);
  SUNContext_Free(&context_);
}

void CvodesSolver::Begin(double tolerance) {
  t_ = 0;
  hybrid_.Reset();
  std::copy(scenario_.x.data(), scenario_.x.data() + kStates, state());
  Check(CVodeSStolerances(memory_, tolerance, tolerance), "CVodeSStolerances");
  if (with_sensitivities_) {
    for (int k = 0; k < kStates; ++k) sensitivity(k) = Vector::Unit(kStates, k);
    std::array<double, kStates> absolute;
    absolute.fill(tolerance);
    Check(CVodeSensSStolerances(memory_, tolerance, absolute.data()), "CVodeSensSStolerances");
  }
  Restart();
}

void CvodesSolver::Restart() {
  Check(CVodeReInit(memory_, t_, state_), "CVodeReInit");
  if (with_sensitivities_) {
    Check(CVodeSensReInit(memory_, CV_STAGGERED, sensitivities_), "CVodeSensReInit");
  }
  Check(CVodeSetStopTime(memory_, scenario_.duration), "CVodeSetStopTime");
}

bool CvodesSolver::FlowToEvent() {
  const int flag = CVode(memory_, scenario_.duration, state_, &t_, CV_NORMAL);
  Check(flag, "CVode");
  if (with_sensitivities_) {
    double t;
    Check(CVodeGetSens(memory_, &t, sensitivities_), "CVodeGetSens");
  }
  if (flag != CV_ROOT_RETURN) return false;
  Check(CVodeGetRootInfo(memory_, roots_.data()), "CVodeGetRootInfo");
  for (int i = 0; i < hybrid_.num_constraints(); ++i) {
    if (roots_[i] != 0) trigger_ = i;
  }
  return true;
}

int CvodesSolver::Field(realtype, N_Vector x, N_Vector xdot, void* self) {
  static_cast<CvodesSolver*>(self)->hybrid_.Field(NV_DATA_S(x), NV_DATA_S(xdot));
  return 0;
}

int CvodesSolver::Gaps(realtype, N_Vector x, realtype* gap, void* self) {
  auto* solver = static_cast<CvodesSolver*>(self);
  solver->hybrid_.Gaps(NV_DATA_S(x), gap, solver->rates_.data());
  return 0;
}

int CvodesSolver::SensitivityField(int count, realtype, N_Vector x, N_Vector, N_Vector* s,
                                   N_Vector* sdot, void* self, N_Vector, N_Vector) {
  const Matrix& jacobian =
      static_cast<CvodesSolver*>(self)->hybrid_.AccelerationJacobian(NV_DATA_S(x));
  const Eigen::Map<const Eigen::Matrix<double, kDof, kStates>> D(jacobian.data());
  for (int k = 0; k < count; ++k) {
    const Eigen::Map<const Eigen::Matrix<double, kStates, 1>> from(NV_DATA_S(s[k]));
    Eigen::Map<Eigen::Matrix<double, kStates, 1>> to(NV_DATA_S(sdot[k]));
    to.head<kDof>() = from.tail<kDof>();
    to.tail<kDof>().noalias() = D.lazyProduct(from);
  }
  return 0;
}

}  // namespace benchmark
}  // namespace contact_flow
