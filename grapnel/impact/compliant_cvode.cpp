#include "grapnel/impact/compliant_cvode.hpp"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <stdexcept>
#include <sundials/sundials_context.hpp>

namespace grapnel {
namespace {

// Of every number, what no method can be asked for.
constexpr double kRelativeTolerance = 1e-14;

struct Free {
  void operator()(N_Vector v) const { N_VDestroy(v); }
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
  void operator()(void* cvode) const { CVodeFree(&cvode); }
};
using Vector = std::unique_ptr<_generic_N_Vector, Free>;

std::span<double> numbers(N_Vector v) { return {NV_DATA_S(v), static_cast<std::size_t>(NV_LENGTH_S(v))}; }

bool finite(std::span<const double> y) {
  double sum = 0;
  for (double x : y) sum += 0 * x;
  return sum == 0;
}

void require(int flag, const char* what) {
  if (flag < 0) throw std::runtime_error(fmt::format("compliant_impact: {} failed ({})", what, flag));
}

}  // namespace

struct StiffIntegrator::Memory {
  CompliantSystem& system;
  sundials::Context context;
  Vector y, scratch, tolerances;
  std::unique_ptr<void, Free> cvode;
  std::unique_ptr<_generic_SUNMatrix, Free> matrix;
  std::unique_ptr<_generic_SUNLinearSolver, Free> solver;
  double t = 0;
  double end = 0;
  long evaluations = 0;
  std::vector<int> crossed, directions;
  std::string said;

  explicit Memory(CompliantSystem& s) : system(s) {}
};

StiffIntegrator::StiffIntegrator(CompliantSystem& system, std::span<const double> tolerances, double end)
    : memory_(std::make_unique<Memory>(system)) {
  Memory& m = *memory_;
  const auto n = static_cast<sunindextype>(system.size());
  const auto vector = [&] { return Vector(N_VNew_Serial(n, m.context)); };
  m.y = vector(), m.scratch = vector(), m.tolerances = vector();
  m.end = end;
  N_VConst(0.0, m.y.get());
  std::copy(tolerances.begin(), tolerances.end(), NV_DATA_S(m.tolerances.get()));
  m.crossed.resize(system.events()), m.directions.resize(system.events());

  // A NaN is an error from which a shorter step may recover; if it does not, the step fails and says so.
  const CVRhsFn rates = [](double t, N_Vector y, N_Vector dydt, void* self) {
    Memory& memory = *static_cast<Memory*>(self);
    ++memory.evaluations;
    memory.system.rates(t, numbers(y), numbers(dydt));
    return finite(numbers(dydt)) ? 0 : 1;
  };
  const CVRootFn events = [](double t, N_Vector y, double* g, void* self) {
    CompliantSystem& s = static_cast<Memory*>(self)->system;
    s.event_values(t, numbers(y), {g, static_cast<std::size_t>(s.events())});
    return 0;
  };
  const CVErrHandlerFn say = [](int code, const char*, const char*, char* text, void* self) {
    if (code < 0) static_cast<Memory*>(self)->said = text;
  };

  m.cvode.reset(CVodeCreate(CV_BDF, m.context));
  void* const cvode = m.cvode.get();
  if (cvode == nullptr) throw std::runtime_error("compliant_impact: CVODE cannot be created");
  require(CVodeSetErrHandlerFn(cvode, say, &m), "CVodeSetErrHandlerFn");
  require(CVodeInit(cvode, rates, 0.0, m.y.get()), "CVodeInit");
  require(CVodeSetUserData(cvode, &m), "CVodeSetUserData");
  require(CVodeSVtolerances(cvode, kRelativeTolerance, m.tolerances.get()), "CVodeSVtolerances");
  m.matrix.reset(SUNDenseMatrix(n, n, m.context));
  m.solver.reset(SUNLinSol_Dense(m.y.get(), m.matrix.get(), m.context));
  require(CVodeSetLinearSolver(cvode, m.solver.get(), m.matrix.get()), "CVodeSetLinearSolver");
  require(CVodeSetStopTime(cvode, end), "CVodeSetStopTime");
  require(CVodeSetMaxHnilWarns(cvode, -1), "CVodeSetMaxHnilWarns");
  require(CVodeSetMaxErrTestFails(cvode, 20), "CVodeSetMaxErrTestFails");
  require(CVodeSetMaxConvFails(cvode, 20), "CVodeSetMaxConvFails");
  if (system.events() > 0) {
    require(CVodeRootInit(cvode, system.events(), events), "CVodeRootInit");
    require(CVodeSetNoInactiveRootWarn(cvode), "CVodeSetNoInactiveRootWarn");
  }
  restart();
}

StiffIntegrator::~StiffIntegrator() = default;

StiffIntegrator::Result StiffIntegrator::step() {
  Memory& m = *memory_;
  const int flag = CVode(m.cvode.get(), m.end, m.y.get(), &m.t, CV_ONE_STEP);
  if (flag < 0 || !finite(numbers(m.y.get()))) {
    if (m.said.empty()) m.said = fmt::format("CVODE returned {}", flag);
    return Result::failed;
  }
  if (flag == CV_ROOT_RETURN) {
    CVodeGetRootInfo(m.cvode.get(), m.crossed.data());
    return Result::event;
  }
  return flag == CV_TSTOP_RETURN ? Result::end : Result::stepped;
}

double StiffIntegrator::time() const { return memory_->t; }
std::span<const double> StiffIntegrator::y() const { return numbers(memory_->y.get()); }
std::span<const int> StiffIntegrator::crossed() const { return memory_->crossed; }
long StiffIntegrator::evaluations() const { return memory_->evaluations; }

std::span<const double> StiffIntegrator::at(double t) {
  Memory& m = *memory_;
  if (t == m.t || CVodeGetDky(m.cvode.get(), t, 0, m.scratch.get()) < 0) return y();
  return numbers(m.scratch.get());
}

void StiffIntegrator::restart() {
  Memory& m = *memory_;
  require(CVodeReInit(m.cvode.get(), m.t, m.y.get()), "CVodeReInit");
  if (m.directions.empty()) return;
  m.system.event_directions(m.directions);
  require(CVodeSetRootDirection(m.cvode.get(), m.directions.data()), "CVodeSetRootDirection");
}

void StiffIntegrator::stop_at(double t) {
  require(CVodeSetStopTime(memory_->cvode.get(), std::min(t, memory_->end)), "CVodeSetStopTime");
}

void StiffIntegrator::limit_step(double longest) { CVodeSetMaxStep(memory_->cvode.get(), longest); }

std::string StiffIntegrator::message() const { return fmt::format("at {:.6g} s: {}", memory_->t, memory_->said); }

}  // namespace grapnel
