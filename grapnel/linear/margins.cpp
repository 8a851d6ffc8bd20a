// Gain, phase and delay margins of each channel, with the others closed.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "grapnel/linear/sampled_system.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Complex = std::complex<double>;
constexpr int kGridPoints = 400;
constexpr double kLargestGain = 1e6;  // limits beyond this factor, or below its inverse, count as none

// The closed loop as X' = F X + G v, or from sample to sample, with v = H X in closed channels.
class BrokenLoop {
 public:
  BrokenLoop(const LinearLoop& loop, const std::vector<LoopChannel>& channels) : loop_(loop), channels_(channels) {
    const auto m = static_cast<Eigen::Index>(channels.size());
    if (loop.timing) {
      system_ = sampled_system(loop, channels, std::vector<double>(channels.size(), loop.timing->delay));
    } else {
      system_.F = loop.A, system_.G.resize(loop.A.rows(), m), system_.H.resize(m, loop.A.rows());
      for (Eigen::Index c = 0; c < m; ++c) {
        system_.G.col(c) = loop.B * channels[static_cast<std::size_t>(c)].direction;
        system_.H.row(c) = channels[static_cast<std::size_t>(c)].gain;
      }
    }
    closed_ = system_.F + system_.G * system_.H;
  }

  /// Loop gains L of all channels at a frequency [rad/s], each with the others closed: S = 1/(1 + L) is the response
  /// of a channel's command to a signal added to it, (27.10).
  Eigen::VectorXcd gains(double frequency) const {
    const Complex s = loop_.timing ? std::exp(Complex(0, frequency * loop_.timing->period)) : Complex(0, frequency);
    Eigen::MatrixXcd resolvent = -closed_.cast<Complex>();
    resolvent.diagonal().array() += s;
    const Eigen::PartialPivLU<Eigen::MatrixXcd> solver(resolvent);
    const Eigen::MatrixXcd x = solver.solve(system_.G.cast<Complex>());
    Eigen::VectorXcd L(system_.G.cols());
    for (Eigen::Index c = 0; c < L.size(); ++c) {
      const Complex S = 1.0 + (system_.H.row(c).cast<Complex>() * x.col(c))(0);
      L[c] = 1.0 / S - 1.0;
    }
    return L;
  }

  /// Frequencies between the slowest and the fastest motion, denser at resonances.
  std::vector<double> grid() const {
    double slowest = std::numeric_limits<double>::infinity(), fastest = 0;
    std::vector<double> w;
    for (const Eigen::MatrixXd& M : {closed_, system_.F}) {
      const Eigen::EigenSolver<Eigen::MatrixXd> solver(M, false);
      for (Eigen::Index i = 0; i < M.rows(); ++i) {
        const Complex value = solver.eigenvalues()[i];
        if (loop_.timing && std::abs(value) < 1e-6) continue;
        const Complex s = loop_.timing ? std::log(value) / loop_.timing->period : value;
        const double size = std::abs(s);
        if (size < 1e-4) continue;
        slowest = std::min(slowest, size), fastest = std::max(fastest, size);
        const double width = std::abs(s.real()) / size;
        for (const double d : {-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0}) {
          if (1 + d * width > 0.05) w.push_back(size * (1 + d * width));
        }
      }
    }
    if (!(fastest > 0)) slowest = fastest = 1;
    const double begin = std::max(1e-2 * slowest, 1e-8 * fastest);
    const double end = loop_.timing ? nyquist() : 1e2 * fastest;
    for (int i = 0; i <= kGridPoints; ++i) w.push_back(begin * std::pow(end / begin, i / double{kGridPoints}));
    std::erase_if(w, [&](double x) { return x > end * (1 + 1e-12); });
    std::sort(w.begin(), w.end());
    w.erase(std::unique(w.begin(), w.end()), w.end());
    if (loop_.timing) w.back() = end;
    return w;
  }
  double period() const { return loop_.timing->period; }
  double nyquist() const { return std::numbers::pi / loop_.timing->period; }

  bool is_stable_with(std::size_t channel, double factor) const {
    LinearLoop changed = loop_;
    changed.K += (factor - 1) * channels_[channel].direction * channels_[channel].gain;
    return is_free_of_growth(changed);
  }
  bool is_stable_with_delay(std::size_t channel, double added) const {
    std::vector<double> delays(channels_.size(), loop_.timing->delay);
    delays[channel] += added;
    return is_free_of_growth(loop_, sampled_system(loop_, channels_, delays));
  }

 private:
  const LinearLoop& loop_;
  const std::vector<LoopChannel>& channels_;
  SampledSystem system_;
  Eigen::MatrixXd closed_;
};

// The zero of a function between two frequencies with values of different sign, by bisection.
template <class F>
double zero_between(double a, double b, double at_a, F&& f) {
  for (int i = 0; i < 60 && b - a > 1e-13 * b; ++i) {
    const double middle = 0.5 * (a + b), value = f(middle);
    ((value > 0) == (at_a > 0) ? a : b) = middle;
  }
  return 0.5 * (a + b);
}

struct Crossings {
  std::vector<std::pair<double, Complex>> of_phase, of_gain;  // frequency, loop gain
};

Crossings crossings_of(const BrokenLoop& loop, const std::vector<double>& w, const std::vector<Eigen::VectorXcd>& L,
                       Eigen::Index channel, bool sampled) {
  Crossings found;
  const auto at = [&](double frequency) { return loop.gains(frequency)[channel]; };
  const auto excess = [](const Complex& gain) { return std::log(std::abs(gain)); };
  for (std::size_t i = 0; i + 1 < w.size(); ++i) {
    const Complex a = L[i][channel], b = L[i + 1][channel];
    if ((excess(a) > 0) != (excess(b) > 0)) {
      const double x = zero_between(w[i], w[i + 1], excess(a), [&](double f) { return excess(at(f)); });
      found.of_gain.emplace_back(x, at(x));
    }
    if ((a.imag() > 0) != (b.imag() > 0) && (a.real() < 0 || b.real() < 0)) {
      const double x = zero_between(w[i], w[i + 1], a.imag(), [&](double f) { return at(f).imag(); });
      found.of_phase.emplace_back(x, at(x));
    }
  }
  const auto end = [&](std::size_t i) {
    const Complex gain = L[i][channel];
    if (gain.real() < 0 && std::abs(gain.imag()) < 1e-6 * std::abs(gain.real()))
      found.of_phase.emplace_back(w[i], gain);
  };
  end(0);
  if (sampled) end(w.size() - 1);
  return found;
}

// The factors on a channel's gains nearest to 1 beyond which the loop is unstable: at crossings of -180 degrees, each
// confirmed by the eigenvalues beyond it.
void set_gain_margin(const BrokenLoop& loop, const Crossings& found, std::size_t channel, LinearModel::Margin& margin) {
  std::vector<std::pair<double, double>> factors;  // with their frequencies
  for (const auto& [frequency, gain] : found.of_phase) {
    const double factor = -1 / gain.real();
    if (factor > 1 / kLargestGain && factor < kLargestGain) factors.emplace_back(factor, frequency);
  }
  std::sort(factors.begin(), factors.end());
  double nearest = std::numeric_limits<double>::infinity();
  const auto take = [&](const std::pair<double, double>& one, std::optional<double>& limit) {
    limit = one.first;
    if (std::abs(std::log(one.first)) >= nearest) return;
    nearest = std::abs(std::log(one.first)), margin.gain_frequency = one.second;
  };
  constexpr double kBeyond = 1.01;
  for (const auto& one : factors) {
    if (one.first < 1 || loop.is_stable_with(channel, one.first * kBeyond)) continue;
    take(one, margin.gain_maximum);
    break;
  }
  for (auto one = factors.rbegin(); one != factors.rend(); ++one) {
    if (one->first > 1 || loop.is_stable_with(channel, one->first / kBeyond)) continue;
    take(*one, margin.gain_minimum);
    break;
  }
}

// The smallest added delay of a sampled channel with which the loop is unstable, near the estimate of the phase margin,
// by bisection on the eigenvalues. Each period of delay is a state, so the estimate is taken where it has many, as the
// sampled loop is nearly continuous then. Absent: the loop is stable far beyond the estimate.
std::optional<double> sampled_delay_margin(const BrokenLoop& loop, std::size_t channel, double estimate) {
  constexpr double kMostPeriods = 40;
  if (estimate > kMostPeriods * loop.period()) return estimate;
  double stable = 0, unstable = 1.5 * estimate;
  for (int i = 0; i < 4 && loop.is_stable_with_delay(channel, unstable); ++i) stable = unstable, unstable *= 1.5;
  if (loop.is_stable_with_delay(channel, unstable)) return std::nullopt;
  if (stable == 0 && !loop.is_stable_with_delay(channel, 0.5 * estimate)) unstable = 0.5 * estimate;
  while (unstable - stable > 1e-5 * unstable) {
    const double middle = 0.5 * (stable + unstable);
    (loop.is_stable_with_delay(channel, middle) ? stable : unstable) = middle;
  }
  return 0.5 * (stable + unstable);
}

}  // namespace

std::vector<LinearModel::Margin> margins_of(const LinearLoop& loop, const std::vector<LoopChannel>& channels) {
  std::vector<LinearModel::Margin> margins;
  if (channels.empty() || loop.A.rows() == 0) return margins;
  const BrokenLoop broken(loop, channels);
  const std::vector<double> w = broken.grid();
  std::vector<Eigen::VectorXcd> L;
  L.reserve(w.size());
  for (const double frequency : w) L.push_back(broken.gains(frequency));
  for (std::size_t c = 0; c < channels.size(); ++c) {
    LinearModel::Margin& margin = margins.emplace_back();
    margin.channel = channels[c].name, margin.unit = channels[c].unit;
    const Crossings found = crossings_of(broken, w, L, static_cast<Eigen::Index>(c), loop.timing.has_value());
    set_gain_margin(broken, found, c, margin);
    for (const auto& [frequency, gain] : found.of_gain) {
      const double phase = std::arg(-gain);  // from -180 degrees
      if (!margin.phase || std::abs(phase) < std::abs(*margin.phase))
        margin.phase = phase, margin.phase_frequency = frequency;
      const double delay = (phase > 0 ? phase : phase + 2 * std::numbers::pi) / frequency;
      if (!margin.delay || delay < *margin.delay) margin.delay = delay;
    }
    if (loop.timing && margin.delay) margin.delay = sampled_delay_margin(broken, c, *margin.delay);
  }
  return margins;
}

}  // namespace grapnel
