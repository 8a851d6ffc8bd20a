// Comparison with SUNDIALS CVODE (variable-order BDF), an independent integration of the same equations: impulses of
// contacts and grasps, separation times, and forces over time.
#include <cvode/cvode.h>
#include <gtest/gtest.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <memory>
#include <sundials/sundials_context.hpp>

#include "grapnel/impact/compliant_scales.hpp"
#include "grapnel/impact/compliant_system.hpp"
#include "impact/compliant_case.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_cvode_test {

struct Free {
  void operator()(N_Vector v) const { N_VDestroy(v); }
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
  void operator()(void* cvode) const { CVodeFree(&cvode); }
};

std::span<double> numbers(N_Vector v) { return {NV_DATA_S(v), static_cast<std::size_t>(NV_LENGTH_S(v))}; }

// CVODE integration of a CompliantSystem. Events that CVODE locates change the contact phases.
class Reference {
 public:
  Reference(CompliantSystem& system, std::vector<double> tolerances) : system_(system) {
    const auto n = static_cast<sunindextype>(system.size());
    y_.reset(N_VNew_Serial(n, context_)), tolerances_.reset(N_VNew_Serial(n, context_));
    N_VConst(0.0, y_.get());
    std::copy(tolerances.begin(), tolerances.end(), NV_DATA_S(tolerances_.get()));
    cvode_.reset(CVodeCreate(CV_BDF, context_));
    matrix_.reset(SUNDenseMatrix(n, n, context_));
    solver_.reset(SUNLinSol_Dense(y_.get(), matrix_.get(), context_));
    void* const cvode = cvode_.get();
    EXPECT_EQ(CVodeInit(cvode, rates, 0.0, y_.get()), CV_SUCCESS);
    EXPECT_EQ(CVodeSetUserData(cvode, this), CV_SUCCESS);
    EXPECT_EQ(CVodeSVtolerances(cvode, 1e-14, tolerances_.get()), CV_SUCCESS);
    EXPECT_EQ(CVodeSetLinearSolver(cvode, solver_.get(), matrix_.get()), CV_SUCCESS);
    EXPECT_EQ(CVodeSetMaxNumSteps(cvode, 1'000'000), CV_SUCCESS);
    if (system.events() > 0) {
      EXPECT_EQ(CVodeRootInit(cvode, system.events(), events), CV_SUCCESS);
      EXPECT_EQ(CVodeSetNoInactiveRootWarn(cvode), CV_SUCCESS);
      watch();
    }
  }

  // Integrates to `until` through all earlier events. The phases afterwards are those after the last event.
  void advance(double until) {
    while (t_ < until) {
      EXPECT_EQ(CVodeSetStopTime(cvode_.get(), until), CV_SUCCESS);
      const int flag = CVode(cvode_.get(), until, y_.get(), &t_, CV_NORMAL);
      ASSERT_GE(flag, 0) << "at " << t_;
      if (flag != CV_ROOT_RETURN) continue;
      std::vector<int> crossed(system_.events());
      CVodeGetRootInfo(cvode_.get(), crossed.data());
      system_.load(t_, y());
      for (int i = 0; i < system_.contact_count(); ++i) {
        for (int which = 1; which >= 0; --which) {
          if (crossed[2 * i + which] == 0) continue;
          system_.phase[i] = system_.phase_after(i, which, system_.loads()[i]);
          last_event_ = t_;
          break;
        }
      }
      EXPECT_EQ(CVodeReInit(cvode_.get(), t_, y_.get()), CV_SUCCESS);
      watch();
    }
  }

  std::span<const double> y() const { return numbers(y_.get()); }
  double last_event() const { return last_event_; }

 private:
  void watch() {
    std::vector<int> directions(system_.events());
    system_.event_directions(directions);
    EXPECT_EQ(CVodeSetRootDirection(cvode_.get(), directions.data()), CV_SUCCESS);
  }
  static int rates(double t, N_Vector y, N_Vector dydt, void* self) {
    static_cast<Reference*>(self)->system_.rates(t, numbers(y), numbers(dydt));
    return 0;
  }
  static int events(double t, N_Vector y, double* g, void* self) {
    CompliantSystem& s = static_cast<Reference*>(self)->system_;
    s.event_values(t, numbers(y), {g, static_cast<std::size_t>(s.events())});
    return 0;
  }

  CompliantSystem& system_;
  sundials::Context context_;
  std::unique_ptr<_generic_N_Vector, Free> y_, tolerances_;
  std::unique_ptr<void, Free> cvode_;
  std::unique_ptr<_generic_SUNMatrix, Free> matrix_;
  std::unique_ptr<_generic_SUNLinearSolver, Free> solver_;
  double t_ = 0, last_event_ = 0;
};

struct Differences {
  Worst impulse{"impulses"}, lost{"energy lost"}, force{"forces at samples, over the largest"},
      velocity{"velocities after, over the largest change"}, part{"when contacts part"};
};

void compare(const Model& model, const State& state, std::span<const CompliantContact> contacts,
             std::span<const CompliantGrasp> grasps, const CompliantSetup& setup, std::span<const int> held, int index,
             Differences& d) {
  const ImpactSolution o = compliant_impact(model, state, contacts, grasps, setup, held);
  ASSERT_NE(o.status, ImpactSolution::Status::failed) << o.message;
  ASSERT_GT(o.duration, 0);
  CompliantSystem system(model, state, contacts, grasps, held);
  const std::vector<double> start(system.size(), 0.0);
  system.load(0, start);
  const CompliantScales scales = compliant_scales(model, state, system, contacts, grasps);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (system.loads()[i].rate > 0) system.phase[i] = ContactPhase::pressing;
  }
  Reference reference(system, absolute_tolerances(model, scales, 1e-12));
  for (std::size_t s = 1; s + 1 < o.times.size(); s += 7) {
    if (o.times[s] == o.times[s - 1] || o.times[s] == o.times[s + 1]) continue;  // an event: forces may jump
    reference.advance(o.times[s]);
    system.load(o.times[s], reference.y());
    for (int i = 0; i < system.interfaces(); ++i) {
      const ForceHistory& h = o.forces[i];
      d.force.note(norm(system.loads()[i].F.linear - h.force[s]) / h.peak_force, index);
      if (h.peak_moment > 0) d.force.note(norm(system.loads()[i].F.angular - h.moment[s]) / h.peak_moment, index);
    }
  }
  reference.advance(o.duration);
  const std::span<const double> y = reference.y();
  double lost = 0;
  for (int i = 0; i < system.interfaces(); ++i) lost += o.forces[i].energy_lost;
  for (int i = 0; i < system.interfaces(); ++i) {
    const ForceHistory& h = o.forces[i];
    const double* const P = &y[system.impulse_offset(i)];
    d.impulse.note(norm(Vector3d{P[3], P[4], P[5]} - h.impulse.linear) / norm(h.impulse.linear), index);
    // The residual spring energy of a relaxing contact counts as lost only after all contacts separate.
    const bool dented = i < system.contact_count() && contacts[i].model == ContactForceModel::kelvin_voigt;
    if (!dented && lost > 0) d.lost.note(std::abs(y[system.loss_offset(i)] - h.energy_lost) / lost, index);
  }
  system.load(o.duration, y);
  double change = 0, off = 0;
  for (std::size_t v = 0; v < state.v.size(); ++v) {
    change = std::max(change, std::abs(o.after.v[v] - state.v[v]));
    off = std::max(off, std::abs(o.after.v[v] - system.now().v[v]));
  }
  d.velocity.note(off / change, index);
  if (contacts.empty()) return;
  reference.advance(o.duration * (1 + 1e-6));
  d.part.note(std::abs(reference.last_event() / o.duration - 1), index);
}

void expect_close(const Differences& d) {
  EXPECT_LT(d.impulse.value(), 2e-9);   // measured 2.1e-10
  EXPECT_LT(d.lost.value(), 2e-8);      // measured 2.3e-9
  EXPECT_LT(d.force.value(), 1e-7);     // measured 1.5e-8, with reversals of friction; 5.2e-10 without
  EXPECT_LT(d.velocity.value(), 2e-9);  // measured 1.8e-10
  EXPECT_LT(d.part.value(), 1e-9);      // measured 9.8e-11
}

TEST(CompliantAgainstCvode, GraspsOfRandomRobots) {
  Differences d;
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    std::vector<CompliantGrasp> grasps;
    for (const Grasp& g : c.grasps) grasps.push_back({g, 1e5, 2e3, 2e4, 4e2});
    compare(c.model, c.state, {}, grasps, {.longest = 0.02}, {}, i, d);
  }
  expect_close(d);
}

TEST(CompliantAgainstCvode, HeldJoints) {
  Differences d;
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  const int held[] = {r.model.bodies()[r.model.body_index("arm-1-link-2")].v,
                      r.model.bodies()[r.model.body_index("arm-2-link-3")].v};
  std::vector<CompliantGrasp> grasps;
  for (const Grasp& g : r.grasps) grasps.push_back({g, 1e6, 5e3, 2e5, 1e3});
  compare(r.model, r.state, {}, grasps, {.longest = 0.05}, held, 0, d);
  expect_close(d);
}

TEST(CompliantAgainstCvode, ContactsOfAllLawsWithFriction) {
  Differences d;
  int index = 0;
  for (ContactForceModel law :
       {ContactForceModel::kelvin_voigt, ContactForceModel::hertz, ContactForceModel::hunt_crossley}) {
    for (int i = 0; i < 3; ++i, ++index) {
      SCOPED_TRACE(seed_note(i));
      const ImpactCase c = random_open_impact(2 * i);
      const Grasp& g = c.grasps[0];
      const Vector3d u = relative_velocity(c.model, c.state, g.robot_body, g.target_body, g.p_WC);
      Vector3d n = -u + 0.6 * norm(u) * Random(i).direction();
      n = (1 / norm(n)) * n;
      CompliantContact contact{g.robot_body, g.target_body, g.p_WC, n, law, 1e7, 1e3, 1.5, 0.3, 1e-2 * norm(u)};
      if (law == ContactForceModel::hunt_crossley) contact.damping = 0.5 / norm(u);
      compare(c.model, c.state, {&contact, 1}, {}, {}, {}, index, d);
    }
  }
  expect_close(d);
}

}  // namespace compliant_cvode_test
}  // namespace grapnel::testing
