#include "grapnel/linear/stability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "grapnel/linear/sampled_system.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Complex = std::complex<double>;

// Smaller rates of growth or decay count as zero, relative to the largest eigenvalue, but at least to 1/s.
constexpr double kGrowth = 1e-7;
// Eigenvalues of smaller magnitude count as zero, likewise: a double zero is computed to the root of the error.
constexpr double kZero = 1e-6, kMostZero = 1e-4;

std::vector<Complex> eigenvalues_of(const Eigen::MatrixXd& M) {
  std::vector<Complex> all;
  if (M.size() == 0) return all;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(M, false);
  for (Eigen::Index i = 0; i < M.rows(); ++i) all.push_back(solver.eigenvalues()[i]);
  return all;
}

double largest(const Eigen::MatrixXd& M) { return M.size() == 0 ? 0 : M.cwiseAbs().maxCoeff(); }

// The loop in the states `kept`; the others are X times these.
LinearLoop restricted(const LinearLoop& loop, const std::vector<int>& kept, const std::vector<int>& solved,
                      const Eigen::MatrixXd& X) {
  LinearLoop rest = loop;
  rest.A = loop.A(kept, kept), rest.B = loop.B(kept, Eigen::all), rest.K = loop.K(Eigen::all, kept);
  if (loop.error.size() > 0) rest.error = loop.error(kept, kept);
  if (!solved.empty()) {
    rest.A += loop.A(kept, solved) * X, rest.K += loop.K(Eigen::all, solved) * X;
    if (loop.error.size() > 0) rest.error += loop.error(kept, solved) * X.cwiseAbs();
  }
  rest.states.clear();
  for (const int i : kept) rest.states.push_back(loop.states[static_cast<std::size_t>(i)]);
  return rest;
}

// The positions on which neither other states nor commands depend.
std::vector<bool> idle_positions(const LinearLoop& loop, int positions) {
  const double small = 1e-11 * largest(loop.A), small_gain = 1e-10 * largest(loop.K);
  std::vector<bool> idle(static_cast<std::size_t>(loop.A.rows()), false);
  std::fill_n(idle.begin(), positions, true);
  const auto has_effect = [&](Eigen::Index i) {
    for (Eigen::Index u = 0; u < loop.K.rows(); ++u) {
      if (std::abs(loop.K(u, i)) > small_gain) return true;
    }
    for (Eigen::Index r = 0; r < loop.A.rows(); ++r) {
      if (idle[static_cast<std::size_t>(r)]) continue;
      if (std::abs(loop.A(r, i)) > small + (loop.error.size() > 0 ? 10 * loop.error(r, i) : 0)) return true;
    }
    return false;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index i = 0; i < positions; ++i) {
      if (!idle[static_cast<std::size_t>(i)] || !has_effect(i)) continue;
      idle[static_cast<std::size_t>(i)] = false, changed = true;
    }
  }
  return idle;
}

}  // namespace

// Loop => the same without conserved momenta, whose states are solved for, and then without the positions that have no
// effect: block by block, the eigenvalues of both are those of the whole, (27.6) and (27.7).
ReducedLoop reduced_loop(LinearLoop loop, const std::optional<ConservedRows>& rows, int positions) {
  ReducedLoop reduced;
  reduced.map = Eigen::MatrixXd::Identity(loop.A.rows(), loop.A.rows());
  if (rows) {
    // (L x)' = turning L x holds in A + B K if the motion is steady.
    constexpr double kSteady = 1e-6;
    const Eigen::MatrixXd closed = loop.K.size() > 0 ? Eigen::MatrixXd(loop.A + loop.B * loop.K) : loop.A;
    const double unsteady =
        (rows->L * closed - rows->turning * rows->L).norm() / std::max(rows->L.norm() * closed.norm(), 1e-300);
    std::vector<int> kept;
    for (int i = 0; i < static_cast<int>(loop.A.rows()); ++i) {
      if (std::find(rows->solved.begin(), rows->solved.end(), i) == rows->solved.end()) kept.push_back(i);
    }
    const Eigen::MatrixXd X =
        -lu_solution(Eigen::MatrixXd(rows->L(Eigen::all, rows->solved)), Eigen::MatrixXd(rows->L(Eigen::all, kept)));
    Eigen::MatrixXd error;  // of A by that of X
    if (rows->error.size() > 0) {
      const Eigen::MatrixXd inverse = lu_solution(Eigen::MatrixXd(rows->L(Eigen::all, rows->solved)),
                                                  Eigen::MatrixXd(Eigen::MatrixXd::Identity(X.rows(), X.rows())));
      const Eigen::MatrixXd of_L = rows->error(Eigen::all, kept) + rows->error(Eigen::all, rows->solved) * X.cwiseAbs();
      error = loop.A(kept, rows->solved).cwiseAbs() * (inverse.cwiseAbs() * of_L);
    }
    loop = restricted(loop, kept, rows->solved, X);
    if (error.size() > 0 && loop.error.size() > 0) loop.error += error;
    Eigen::MatrixXd map = reduced.map(Eigen::all, kept);
    map += reduced.map(Eigen::all, rows->solved) * X;
    reduced.map = map;
    reduced.conserved = eigenvalues_of(rows->turning);
    reduced.is_steady = unsteady <= kSteady;
    if (!reduced.is_steady)
      reduced.unsteady = fmt::format(
          "the motion is not steady: momentum is conserved in the model only to {:.1g}, "
          "and the eigenvalues are those of this instant",
          unsteady);
  }
  const std::vector<bool> idle = idle_positions(loop, positions);
  std::vector<int> removed, kept;
  for (std::size_t i = 0; i < idle.size(); ++i) (idle[i] ? removed : kept).push_back(static_cast<int>(i));
  reduced.drift = eigenvalues_of(loop.A(removed, removed));
  reduced.loop = restricted(loop, kept, {}, {});
  reduced.map = Eigen::MatrixXd(reduced.map(Eigen::all, kept));
  return reduced;
}

// A, B over a time t => exp(A t) and its integral times B, by the exponential of [A, B; 0, 0].
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> held_over(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, double t) {
  const Eigen::Index n = A.rows(), m = B.cols();
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(n + m, n + m);
  both.topLeftCorner(n, n) = A * t, both.topRightCorner(n, m) = B * t;
  const Eigen::MatrixXd exponential = both.exp();
  return {exponential.topLeftCorner(n, n), exponential.topRightCorner(n, m)};
}

HeldInput hold_inputs(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, const ControlTiming& timing) {
  HeldInput held;
  const double T = timing.period;
  held.whole = static_cast<int>(std::floor(timing.delay / T * (1 + 1e-12) + 1e-12));
  const double late = std::max(0.0, timing.delay - held.whole * T);
  const auto [to_end, now] = held_over(A, B, T - late);
  held.now = now;
  if (late > 1e-12 * T) {
    const auto [first, earlier] = held_over(A, B, late);
    held.Ad = to_end * first;
    held.previous = to_end * earlier;
  } else {
    held.Ad = to_end;
    held.previous = Eigen::MatrixXd::Zero(B.rows(), B.cols());
  }
  return held;
}

// Channels, one delay each => X[k+1] = F X[k] + G v[k], v[k] = H X[k], with X = [x; past commands, per channel the
// latest first], (27.9).
SampledSystem sampled_system(const LinearLoop& loop, const std::vector<LoopChannel>& channels,
                             const std::vector<double>& delays) {
  const Eigen::Index n = loop.A.rows();
  std::vector<HeldInput> held;
  Eigen::Index size = n;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    held.push_back(hold_inputs(loop.A, loop.B * channels[c].direction, {loop.timing->period, delays[c]}));
    size += held.back().whole + 1;
  }
  const auto m = static_cast<Eigen::Index>(channels.size());
  SampledSystem system{Eigen::MatrixXd::Zero(size, size), Eigen::MatrixXd::Zero(size, m),
                       Eigen::MatrixXd::Zero(m, size)};
  system.F.topLeftCorner(n, n) =
      channels.empty() ? Eigen::MatrixXd((loop.A * loop.timing->period).exp()) : held.front().Ad;
  Eigen::Index at = n;
  for (Eigen::Index c = 0; c < m; ++c) {
    const HeldInput& one = held[static_cast<std::size_t>(c)];
    const Eigen::Index whole = one.whole;
    // A command of age a, in periods, is v for a = 0, and state at + a - 1 otherwise.
    if (whole == 0)
      system.G.col(c).head(n) += one.now;
    else
      system.F.col(at + whole - 1).head(n) += one.now;
    system.F.col(at + whole).head(n) += one.previous;
    system.G(at, c) = 1;
    for (Eigen::Index a = 1; a <= whole; ++a) system.F(at + a, at + a - 1) = 1;
    system.H.row(c).head(n) = channels[static_cast<std::size_t>(c)].gain;
    at += whole + 1;
  }
  return system;
}

namespace {

// One channel for each input that the loop uses.
std::vector<LoopChannel> input_channels(const LinearLoop& loop) {
  std::vector<LoopChannel> channels;
  for (Eigen::Index u = 0; u < loop.K.rows(); ++u) {
    if (loop.K.row(u).isZero(0)) continue;
    channels.push_back({"", "", Eigen::VectorXd::Unit(loop.K.rows(), u), loop.K.row(u)});
  }
  return channels;
}

// Right eigenvectors, in columns => participation factors |w_k v_k| of the first `states` states, one column per
// eigenvalue [Pérez-Arriaga et al. 1982]. They do not depend on the units of the states, unlike components. Components
// if the eigenvectors are dependent.
Eigen::MatrixXd participation(const Eigen::MatrixXcd& right, Eigen::Index states) {
  const Eigen::MatrixXcd left = right.partialPivLu().inverse();
  Eigen::MatrixXd factors = right.cwiseProduct(left.transpose()).cwiseAbs().topRows(states);
  if (!factors.allFinite()) factors = right.cwiseAbs().topRows(states);
  return factors;
}

// The first of the largest entries, apart from rounding errors: position and rate of an oscillation participate alike.
int largest_at(const Eigen::VectorXd& factors) {
  constexpr double kEqual = 1 - 1e-6;
  Eigen::Index at = 0;
  while (at < factors.size() && factors[at] < kEqual * factors.maxCoeff()) ++at;
  return static_cast<int>(at);
}

// Eigenvalues with the states that participate most; of a sampled loop z as well.
struct Spectrum {
  std::vector<Complex> s, z;
  std::vector<int> state;
};

Spectrum spectrum_of(const LinearLoop& loop) {
  Spectrum found;
  Eigen::MatrixXd M = loop.A;
  if (loop.timing) {
    const std::vector<LoopChannel> channels = input_channels(loop);
    const SampledSystem system =
        sampled_system(loop, channels, std::vector<double>(channels.size(), loop.timing->delay));
    M = system.F + system.G * system.H;
  } else if (loop.K.size() > 0) {
    M += loop.B * loop.K;
  }
  if (M.size() == 0) return found;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(M);
  const Eigen::MatrixXd factors = participation(solver.eigenvectors(), loop.A.rows());
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    const Complex value = solver.eigenvalues()[i];
    if (loop.timing && std::abs(value) < 1e-6) continue;  // delays alone
    found.s.push_back(loop.timing ? std::log(value) / loop.timing->period : value);
    if (loop.timing) found.z.push_back(value);
    found.state.push_back(loop.A.rows() > 0 ? largest_at(factors.col(i)) : 0);
  }
  return found;
}

double scale_of(const std::vector<Complex>& s) {
  double scale = 1;
  for (const Complex& one : s) {
    if (std::isfinite(one.imag())) scale = std::max(scale, std::abs(one.imag()) + std::max(0.0, one.real()));
    if (one.imag() == 0 && std::isfinite(one.real())) scale = std::max(scale, std::min(std::abs(one.real()), 1e4));
  }
  return scale;
}

// Eigenvalues of free rotation are at most as large as its rate; this factor allows for what moves with it.
constexpr double kTumbling = 1.1;

LinearModel::Kind kind_of(const Complex& s, double scale, double free_rotation) {
  using Kind = LinearModel::Kind;
  if (std::abs(s) <= std::min(kMostZero, kZero * scale)) return Kind::drift;
  if (s.real() >= -kGrowth * scale && std::abs(s) <= kTumbling * free_rotation) return Kind::tumbles;
  if (s.real() > kGrowth * scale) return Kind::grows;
  return s.real() < -kGrowth * scale ? Kind::decays : Kind::oscillates;
}

bool none_grows(const std::vector<Complex>& all, double free_rotation) {
  const double scale = scale_of(all);
  return std::ranges::none_of(
      all, [&](const Complex& s) { return kind_of(s, scale, free_rotation) == LinearModel::Kind::grows; });
}

LinearModel::Eigenvalue eigenvalue(const Complex& s, LinearModel::Kind kind, const std::string& state) {
  LinearModel::Eigenvalue one;
  one.kind = kind, one.real = s.real() + 0.0, one.imaginary = s.imag() + 0.0, one.frequency = std::abs(s);
  if (one.frequency > 0) one.damping_ratio = -s.real() / one.frequency;
  one.state = state;
  return one;
}

std::string text_of(const LinearModel::Eigenvalue& e) {
  return e.imaginary == 0 ? fmt::format("{:.4g} 1/s", e.real)
                          : fmt::format("{:.4g} +- {:.4g}i 1/s", e.real, std::abs(e.imaginary));
}

}  // namespace

bool is_free_of_growth(const LinearLoop& loop) { return none_grows(spectrum_of(loop).s, loop.free_rotation); }

bool is_free_of_growth(const LinearLoop& loop, const SampledSystem& system) {
  std::vector<Complex> s;
  for (const Complex& z : eigenvalues_of(system.F + system.G * system.H)) {
    if (std::abs(z) >= 1e-6) s.push_back(std::log(z) / loop.timing->period);
  }
  return none_grows(s, loop.free_rotation);
}

namespace {

// Eigenvalues in their order => verdict and reason. A growth or decay that is slower than the motion changes, a growth
// that may be tumbling or that changes in its own time constant, and limits that the model lacks decide nothing, unless
// the same loop grows at rest.
void judge(LinearModel::Modes& modes, const ReducedLoop& reduced, double scale) {
  using Kind = LinearModel::Kind;
  using Stability = LinearModel::Stability;
  const auto find = [&](auto&& is) { return std::ranges::find_if(modes.eigenvalues, is); };
  const auto end = modes.eigenvalues.end();
  const auto grows = find([](const auto& e) { return e.kind == Kind::grows; });
  const auto swings = find([](const auto& e) { return e.kind == Kind::oscillates; });
  const auto turns = find([&](const auto& e) { return e.kind == Kind::tumbles && e.real > kGrowth * scale; });
  std::size_t decaying = 0;
  double slowest = std::numeric_limits<double>::infinity();
  for (const LinearModel::Eigenvalue& e : modes.eigenvalues) {
    if (e.kind == Kind::decays) ++decaying, slowest = std::min(slowest, -e.real);
  }
  const double rate = reduced.loop.motion_rate;
  const std::string count = fmt::format("{} of {} eigenvalues decay, none grows", decaying,
                                        modes.eigenvalues.size() + reduced.drift.size() + reduced.conserved.size());
  const auto decide = [&](Stability verdict, std::string reason) {
    modes.verdict = verdict, modes.reason = std::move(reason);
  };
  constexpr double kSmallChange = 0.1;
  const bool is_lasting = reduced.loop.change ? *reduced.loop.change <= kSmallChange : reduced.is_steady || rate == 0;
  const std::optional<LinearModel::Eigenvalue>& at_rest = reduced.loop.growth_at_rest;
  if (grows != end && at_rest)
    decide(Stability::unstable,
           fmt::format("the eigenvalue {} grows, mainly in {}, and at rest in this configuration {}, mainly in {}",
                       text_of(*grows), grows->state, text_of(*at_rest), at_rest->state));
  else if (grows != end && grows->real < rate)
    decide(Stability::undecided, fmt::format("the eigenvalue {} grows, mainly in {}, but slower than the motion turns, "
                                             "{:.4g} rad/s",
                                             text_of(*grows), grows->state, rate));
  else if (grows != end && !is_lasting)
    decide(Stability::undecided,
           fmt::format("the eigenvalue {} grows at this instant, mainly in {}, but {}", text_of(*grows), grows->state,
                       reduced.loop.change && std::isfinite(*reduced.loop.change)
                           ? fmt::format("the motion changes it by {:.2g} of its size in its time constant",
                                         *reduced.loop.change)
                           : std::string("nothing shows that this lasts: the motion may not be steady")));
  else if (grows != end)
    decide(Stability::unstable, fmt::format("the eigenvalue {} grows, mainly in {}", text_of(*grows), grows->state));
  else if (turns != end)
    decide(Stability::undecided, fmt::format("the eigenvalue {} grows within the rate of the free rotation, mainly in "
                                             "{}: tumbling, or a joint that its law does not hold",
                                             text_of(*turns), turns->state));
  else if (swings != end)
    decide(Stability::marginal,
           fmt::format("the eigenvalue {} neither grows nor decays, mainly in {}", text_of(*swings), swings->state));
  else if (decaying == 0)
    decide(Stability::marginal, count);
  else if (slowest < rate)
    decide(Stability::undecided,
           fmt::format("{}, but {:.4g} 1/s is slower than the motion turns, {:.4g} rad/s", count, slowest, rate));
  else
    decide(Stability::stable, count);
  const bool lacks_limits = !reduced.loop.doubts.empty();
  if (modes.verdict == Stability::stable && (lacks_limits || !reduced.unsteady.empty()))
    modes.verdict = Stability::undecided;
  if (modes.verdict == Stability::unstable && lacks_limits && !at_rest) modes.verdict = Stability::undecided;
  if (!reduced.unsteady.empty()) modes.reason += "; " + reduced.unsteady;
  for (const std::string& doubt : reduced.loop.doubts) modes.reason += "; " + doubt;
}

}  // namespace

LinearModel::Modes modes_of(const ReducedLoop& reduced) {
  using Kind = LinearModel::Kind;
  LinearModel::Modes modes;
  const Spectrum found = spectrum_of(reduced.loop);
  const double scale = scale_of(found.s);
  for (std::size_t i = 0; i < found.s.size(); ++i) {
    modes.eigenvalues.push_back(eigenvalue(found.s[i], kind_of(found.s[i], scale, reduced.loop.free_rotation),
                                           reduced.loop.states[static_cast<std::size_t>(found.state[i])]));
    if (!found.z.empty())
      modes.eigenvalues.back().z_real = found.z[i].real(), modes.eigenvalues.back().z_imaginary = found.z[i].imag();
  }
  const auto rank = [](const LinearModel::Eigenvalue& e) { return e.kind == Kind::drift; };
  std::stable_sort(modes.eigenvalues.begin(), modes.eigenvalues.end(), [&](const auto& a, const auto& b) {
    if (rank(a) != rank(b)) return rank(b);
    return a.real != b.real ? a.real > b.real : a.imaginary > b.imaginary;
  });
  const auto is_of = [](Kind kind) { return [kind](const LinearModel::Eigenvalue& e) { return e.kind == kind; }; };
  const auto tumbling = static_cast<std::size_t>(std::ranges::count_if(modes.eigenvalues, is_of(Kind::tumbles)));
  const auto of_drift = static_cast<std::size_t>(std::ranges::count_if(modes.eigenvalues, is_of(Kind::drift)));
  judge(modes, reduced, scale);
  if (const std::size_t drift = of_drift + reduced.drift.size(); drift + tumbling + reduced.conserved.size() > 0)
    modes.reason += fmt::format("; {} of drift, {} of tumbling and {} of conserved momenta do not count", drift,
                                tumbling, reduced.conserved.size());
  for (const Complex& s : reduced.drift) modes.eigenvalues.push_back(eigenvalue(s, Kind::drift, "without effect"));
  for (const Complex& s : reduced.conserved) modes.eigenvalues.push_back(eigenvalue(s, Kind::conserved, "momentum"));
  if (!reduced.loop.timing) return modes;
  for (LinearModel::Eigenvalue& e : modes.eigenvalues) {
    const Complex z = std::exp(Complex(e.real, e.imaginary) * reduced.loop.timing->period);
    if (!e.z_real) e.z_real = z.real(), e.z_imaginary = z.imag();
  }
  return modes;
}

}  // namespace grapnel
