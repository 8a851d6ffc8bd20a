// Comparison with SUNDIALS CVODE, an independent integrator of another family (variable-order Adams and BDF).
#include <cvode/cvode.h>
#include <gtest/gtest.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <functional>
#include <memory>
#include <sundials/sundials_context.hpp>
#include <vector>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/integrate.hpp"
#include "integrate/problems.hpp"

namespace grapnel {
namespace cvode_test {

using problems::largest_difference;
using problems::RigidBody;
using problems::Vector;
using Rhs = std::function<void(double, std::span<const double>, std::span<double>)>;

int call_rhs(double t, N_Vector y, N_Vector dydt, void* rhs) {
  const auto n = static_cast<std::size_t>(NV_LENGTH_S(y));
  (*static_cast<Rhs*>(rhs))(t, {NV_DATA_S(y), n}, {NV_DATA_S(dydt), n});
  return 0;
}

struct Free {
  void operator()(N_Vector v) const { N_VDestroy(v); }
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
  void operator()(void* cvode) const { CVodeFree(&cvode); }
};

// CVODE's states at the output times, one after the other; method is CV_ADAMS or CV_BDF.
Vector cvode_solution(int method, Rhs rhs, const Vector& y0, const Vector& outputs, double tolerance) {
  const auto n = static_cast<sunindextype>(y0.size());
  const sundials::Context context;
  const std::unique_ptr<_generic_N_Vector, Free> y(N_VNew_Serial(n, context));
  std::copy(y0.begin(), y0.end(), NV_DATA_S(y.get()));
  const std::unique_ptr<void, Free> cvode(CVodeCreate(method, context));
  EXPECT_EQ(CVodeInit(cvode.get(), call_rhs, 0.0, y.get()), CV_SUCCESS);
  EXPECT_EQ(CVodeSStolerances(cvode.get(), tolerance, tolerance), CV_SUCCESS);
  EXPECT_EQ(CVodeSetUserData(cvode.get(), &rhs), CV_SUCCESS);
  EXPECT_EQ(CVodeSetMaxNumSteps(cvode.get(), 10'000'000), CV_SUCCESS);
  const std::unique_ptr<_generic_SUNMatrix, Free> matrix(SUNDenseMatrix(n, n, context));
  const std::unique_ptr<_generic_SUNLinearSolver, Free> solver(SUNLinSol_Dense(y.get(), matrix.get(), context));
  EXPECT_EQ(CVodeSetLinearSolver(cvode.get(), solver.get(), matrix.get()), CV_SUCCESS);

  Vector states;
  for (const double t : outputs) {
    double reached = 0.0;
    EXPECT_EQ(CVodeSetStopTime(cvode.get(), t), CV_SUCCESS);
    EXPECT_GE(CVode(cvode.get(), t, y.get(), &reached, CV_NORMAL), 0);
    states.insert(states.end(), NV_DATA_S(y.get()), NV_DATA_S(y.get()) + n);
  }
  return states;
}

Vector own_solution(const Manifold& manifold, const Rhs& rhs, const Vector& y0, const Vector& outputs,
                    double tolerance) {
  DormandPrince853<double> stepper(manifold, {.rtol = tolerance, .atol = tolerance});
  Vector states;
  const auto result =
      integrate(stepper, rhs, 0.0, y0, outputs.back(),
                ObservedTimes{outputs, [&](double, auto y) { states.insert(states.end(), y.begin(), y.end()); }});
  EXPECT_TRUE(result.finished()) << result.explanation();
  return states;
}

TEST(AgainstCvode, TriaxialRigidBody) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  const Vector y0 = {1, 0, 0, 0, 0.2, 1.1, 0.1};  // near the unstable axis: it tumbles
  const Vector outputs = {1.0, 5.0, 10.0, 20.0};
  const Vector own = own_solution(RigidBody::manifold(), body, y0, outputs, 1e-13);
  const Vector cvode = cvode_solution(CV_ADAMS, body, y0, outputs, 1e-13);
  ASSERT_EQ(own.size(), cvode.size());
  EXPECT_LT(largest_difference(own, cvode), 1e-9);  // measured 3.2e-11
  EXPECT_GT(largest_difference(std::span(own).last(7), y0), 0.5);
}

// A slow pendulum on a stiff damped spring: stability limits the explicit method's steps; the result stays accurate.
TEST(AgainstCvode, StiffOscillator) {
  const Rhs rhs = [](double, std::span<const double> y, std::span<double> dydt) {
    dydt[0] = y[2];
    dydt[1] = y[3];
    dydt[2] = -std::sin(y[0]) + 0.5 * y[1];
    dydt[3] = -1e6 * (y[1] - 1e-3 * y[0]) - 2e3 * y[3];  // 1000 rad/s, critically damped
  };
  const Vector y0 = {1.0, 0.01, 0.0, 0.0};
  const Vector outputs = {1e-3, 0.01, 0.1, 1.0, 2.0};
  const Vector own = own_solution({.size = 4}, rhs, y0, outputs, 1e-12);
  const Vector cvode = cvode_solution(CV_BDF, rhs, y0, outputs, 1e-12);
  ASSERT_EQ(own.size(), cvode.size());
  EXPECT_LT(largest_difference(own, cvode), 1e-9);  // measured 6.6e-11
}

}  // namespace cvode_test
}  // namespace grapnel
