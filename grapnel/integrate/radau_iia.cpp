#include "grapnel/integrate/radau_iia.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace grapnel {
namespace {

constexpr int kStages = RadauIIA::kStages;
using Square = Eigen::Matrix<double, kStages, kStages>;
using Wide = Eigen::Matrix<long double, kStages, kStages>;
using WideColumn = Eigen::Matrix<long double, kStages, 1>;

constexpr double kIncrement = 1e-7;      // increment of finite differences, relative to the numbers' sizes
constexpr int kMaxIterations = 10;       // of Newton's method
constexpr double kSlow = 0.1;            // contraction rate above which new derivatives pay off
constexpr double kSameLength = 1e-3;     // relative difference of steps that share factors
constexpr double kMaxExtrapolation = 4;  // maximum extrapolation of the last step's polynomial, in step lengths
constexpr double kMaxGrowth = 8, kMaxShrinking = 0.1;
constexpr int kMaxAttempts = 120;               // maximum number of attempts of a step, each shorter than the last
constexpr double kOrder = 1.0 / (kStages + 1);  // of the estimate, h^6

struct Tableau {
  std::array<double, kStages> c;  // nodes
  Square a;
  double gamma0;                        // real eigenvalue of a
  std::array<double, kStages> e;        // (12.23)
  std::array<double, kStages> scale{};  // of the polynomials of basis()
  // a = V diag(lambda) V^-1: the real eigenvalue and the two with positive imaginary part, their columns v of V and
  // rows w of V^-1.
  double lambda_re[3], lambda_im[3];
  double v_re[3][kStages], v_im[3][kStages], w_re[3][kStages], w_im[3][kStages];
};

// P_5(x) - P_4(x) of Legendre's polynomials, whose zeros in ]-1, 1[ and 1 are the nodes on [-1, 1].
long double node_function(long double x) {
  long double before = 1, now = x;
  for (int k = 1; k < kStages; ++k) {
    const long double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
    before = now, now = next;
  }
  return now - before;
}

// The Radau points on [0, 1]: bracketed zeros of P_5 - P_4, by bisection in extended precision, and 1.
std::array<long double, kStages> nodes() {
  std::array<long double, kStages> c{};
  int found = 0;
  constexpr int kCells = 64;
  for (int i = 0; i < kCells; ++i) {
    long double a = -1 + 2.0L * i / kCells, b = -1 + 2.0L * (i + 1) / kCells;
    if (i == kCells - 1) b = 1 - 1e-3L;  // 1 is a separate node
    const long double at_a = node_function(a);
    if ((at_a > 0) == (node_function(b) > 0)) continue;
    for (int k = 0; k < 80; ++k) {
      const long double middle = 0.5L * (a + b);
      ((node_function(middle) > 0) == (at_a > 0) ? a : b) = middle;
    }
    c.at(found++) = 0.5L * (1 + 0.5L * (a + b));
  }
  c.at(found) = 1;
  return c;
}

// Coefficients of the method in extended precision: collocation matrix a, weights e of the error estimate (12.23),
// eigenvalues and eigenvectors of a.
Tableau make_tableau() {
  Tableau t;
  const std::array<long double, kStages> c = nodes();
  // Collocation: sum_j a_ij c_j^(k-1) = c_i^k / k. The estimate's quadrature b^ has a node at 0, of weight gamma0:
  // sum_i b^_i c_i^(k-1) + gamma0 [k = 1] = 1 / k, k = 1 ... 5; e = (b^ - b) a^-1, b the last row of a.
  Wide powers, integrals;
  for (int i = 0; i < kStages; ++i) {
    t.c[i] = static_cast<double>(c[i]);
    long double power = 1;
    for (int k = 0; k < kStages; ++k) {
      powers(i, k) = power;
      power *= c[i];
      integrals(i, k) = power / (k + 1);
    }
  }
  const Wide inverse_powers = powers.inverse();
  const Wide a = integrals * inverse_powers;
  t.a = a.cast<double>();
  const Eigen::EigenSolver<Square> eigen(t.a);
  const Eigen::Matrix<std::complex<double>, kStages, kStages> V = eigen.eigenvectors(), W = V.inverse();
  int pairs = 0;
  for (int k = 0; k < kStages; ++k) {
    const std::complex<double> lambda = eigen.eigenvalues()[k];
    if (lambda.imag() < 0) continue;
    const int place = lambda.imag() > 0 ? ++pairs : 0;
    t.lambda_re[place] = lambda.real(), t.lambda_im[place] = lambda.imag();
    for (int i = 0; i < kStages; ++i) {
      t.v_re[place][i] = V(i, k).real(), t.v_im[place][i] = V(i, k).imag();
      t.w_re[place][i] = W(k, i).real(), t.w_im[place][i] = W(k, i).imag();
    }
  }
  t.gamma0 = t.lambda_re[0];
  WideColumn moments;
  for (int k = 0; k < kStages; ++k) moments[k] = 1.0L / (k + 1) - (k == 0 ? static_cast<long double>(t.gamma0) : 0.0L);
  const WideColumn weights = inverse_powers.transpose() * moments;  // b^
  const WideColumn difference = weights - a.row(kStages - 1).transpose();
  const WideColumn e = a.transpose().inverse() * difference;
  for (int i = 0; i < kStages; ++i) {
    t.e[i] = static_cast<double>(e[i]);
    long double product = c[i];
    for (int j = 0; j < kStages; ++j) product *= j == i ? 1 : c[i] - c[j];
    t.scale[i] = static_cast<double>(1 / product);
  }
  return t;
}

const Tableau& tableau() {
  static const Tableau t = make_tableau();
  return t;
}

// The polynomials that are 1 at node j, 0 at the others and at 0.
std::array<double, kStages> basis(double s) {
  const Tableau& T = tableau();
  std::array<double, kStages> L;
  for (int j = 0; j < kStages; ++j) {
    L[j] = s * T.scale[j];
    for (int i = 0; i < kStages; ++i) L[j] *= i == j ? 1 : s - T.c[i];
  }
  return L;
}

bool finite(std::span<const double> x) {
  double sum = 0;
  for (double each : x) sum += 0 * each;
  return sum == 0;
}

// The arrays never overlap; with __restrict the compiler vectorizes these short loops without run-time checks.

// y += a x.
inline void add(int n, double a, const double* __restrict x, double* __restrict y) {
  for (int i = 0; i < n; ++i) y[i] += a * x[i];
}

// y -= a x of complex numbers.
inline void subtract(int n, std::complex<double> a, const double* __restrict re, const double* __restrict im,
                     double* __restrict y_re, double* __restrict y_im) {
  const double a_re = a.real(), a_im = a.imag();
  for (int i = 0; i < n; ++i) {
    y_re[i] -= re[i] * a_re - im[i] * a_im;
    y_im[i] -= re[i] * a_im + im[i] * a_re;
  }
}

// y += factor M x, M column-major; four columns at a time save three of four accesses to y.
void add_product(double factor, const std::vector<double>& M, std::span<const double> x, double* __restrict y,
                 int rows) {
  const double* column = M.data();
  std::size_t j = 0;
  for (; j + 4 <= x.size(); j += 4, column += 4 * rows) {
    const double a = factor * x[j], b = factor * x[j + 1], c = factor * x[j + 2], d = factor * x[j + 3];
    const double *const second = column + rows, *const third = second + rows, *const fourth = third + rows;
    for (int i = 0; i < rows; ++i) y[i] += (a * column[i] + b * second[i]) + (c * third[i] + d * fourth[i]);
  }
  for (; j < x.size(); ++j, column += rows) add(rows, factor * x[j], column, y);
}

}  // namespace

RadauIIA::RadauIIA(StiffSystem system, std::span<const double> start, std::span<const double> sizes,
                   std::span<const double> tolerances)
    : system_(std::move(system)),
      sizes_(sizes.begin(), sizes.end()),
      tolerances_(tolerances.begin(), tolerances.end()),
      y_(start.begin(), start.end()),
      y_begin_(y_) {
  const std::size_t n = system_.size(), x = system_.positions, w = system_.rates;
  sizes_.resize(x + w), tolerances_.resize(x + w);
  const std::size_t points = std::max<std::size_t>(kStages, x + w);
  slope_.resize(n), end_slope_.resize(n), moved_slope_.resize(n), sum_.resize(n);
  times_.resize(points), moved_.resize(points * n), slopes_.resize((x + w) * n);
  for (std::vector<double>* each : {&Z_, &F_, &R_, &last_Z_, &scratch_}) each->assign(kStages * n, 0.0);
  X_w_.resize(x * w), W_w_.resize(w * w), W_x_.resize(w * x), curvature_.resize(w * w);
  for (Factors& f : factors_) f.re.resize(w * w), f.im.resize(w * w), f.pivot.resize(w);
  re_.resize(w), im_.resize(w);
}

bool RadauIIA::evaluate(std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
  evaluations_ += static_cast<long>(t.size());
  system_.derivatives(t, y, dydt);
  return finite(dydt);
}

bool RadauIIA::fail(const char* why) {
  message_ = why;
  return false;
}

// One-sided differences; the slow dependence of X on x is left to the iteration.
void RadauIIA::difference() {
  ++jacobians_;
  const int x = system_.positions, w = system_.rates, n = system_.size();
  for (int j = 0; j < x + w; ++j) {
    double* const moved = stage(moved_, j);
    std::copy(y_begin_.begin(), y_begin_.end(), moved);
    moved[j] += kIncrement * sizes_[j];
    times_[j] = begin_;
  }
  const auto count = static_cast<std::size_t>(x + w);
  evaluate({times_.data(), count}, {moved_.data(), count * n}, slopes_);
  for (int j = 0; j < x + w; ++j) {
    const double by = 1 / (stage(moved_, j)[j] - y_begin_[j]);
    const double* const slope = stage(slopes_, j);
    if (j >= x) {
      for (int i = 0; i < x; ++i) X_w_[(j - x) * x + i] = by * (slope[i] - slope_[i]);
    }
    double* const column = j < x ? &W_x_[static_cast<std::size_t>(j) * w] : &W_w_[static_cast<std::size_t>(j - x) * w];
    for (int i = 0; i < w; ++i) column[i] = by * (slope[x + i] - slope_[x + i]);
    if (!limits_quadratures()) continue;
    const int g = system_.quadratures, first = system_.coupled();
    for (int i = 0; i < g; ++i) G_[static_cast<std::size_t>(j) * g + i] = by * (slope[first + i] - slope_[first + i]);
  }
  std::fill(curvature_.begin(), curvature_.end(), 0.0);
  for (int j = 0; j < w; ++j) {
    add_product(1, W_x_, std::span(X_w_).subspan(static_cast<std::size_t>(j) * x, x),
                &curvature_[static_cast<std::size_t>(j) * w], w);
  }
  derivatives_known_ = derivatives_fresh_ = true;
  factors_known_ = false;
}

namespace {

// LU decomposition in place, column-major, with row exchanges; false: singular or not finite. Real matrices leave `im`
// unchanged.
template <bool complex>
bool decompose(int n, double* re, double* im, int* pivot) {
  for (int k = 0; k < n; ++k) {
    double* const re_k = re + static_cast<std::ptrdiff_t>(k) * n;
    double* const im_k = im + static_cast<std::ptrdiff_t>(k) * n;
    int best = k;
    double largest = -1;
    for (int i = k; i < n; ++i) {
      const double size = complex ? re_k[i] * re_k[i] + im_k[i] * im_k[i] : std::abs(re_k[i]);
      if (size > largest) largest = size, best = i;
    }
    pivot[k] = best;
    if (!(largest > 0) || !std::isfinite(largest)) return false;
    if (best != k) {
      for (int j = 0; j < n; ++j) {
        std::swap(re[j * n + k], re[j * n + best]);
        if (complex) std::swap(im[j * n + k], im[j * n + best]);
      }
    }
    if constexpr (complex) {
      const double by_re = re_k[k] / largest, by_im = -im_k[k] / largest;
      for (int i = k + 1; i < n; ++i) {
        const double r = re_k[i] * by_re - im_k[i] * by_im;
        im_k[i] = re_k[i] * by_im + im_k[i] * by_re;
        re_k[i] = r;
      }
      re_k[k] = by_re, im_k[k] = by_im;  // inverse of the pivot
    } else {
      const double by = 1 / re_k[k];
      for (int i = k + 1; i < n; ++i) re_k[i] *= by;
      re_k[k] = by;
    }
    for (int j = k + 1; j < n; ++j) {
      double* const re_j = re + static_cast<std::ptrdiff_t>(j) * n;
      double* const im_j = im + static_cast<std::ptrdiff_t>(j) * n;
      const int at = k + 1;
      if constexpr (complex) {
        subtract(n - at, {re_j[k], im_j[k]}, re_k + at, im_k + at, re_j + at, im_j + at);
      } else {
        add(n - at, -re_j[k], re_k + at, re_j + at);
      }
    }
  }
  return true;
}

// Right-hand side => solution of the real or complex linear system by the LU factors, in place.
template <bool complex>
void solve(int n, const double* re, const double* im, const int* pivot, double* x, double* y) {
  for (int k = 0; k < n; ++k) {
    std::swap(x[k], x[pivot[k]]);
    if constexpr (complex) std::swap(y[k], y[pivot[k]]);
  }
  for (int k = 0; k < n; ++k) {
    const double *re_k = re + static_cast<std::ptrdiff_t>(k) * n, *im_k = im + static_cast<std::ptrdiff_t>(k) * n;
    const int at = k + 1;
    if constexpr (complex) {
      subtract(n - at, {x[k], y[k]}, re_k + at, im_k + at, x + at, y + at);
    } else {
      add(n - at, -x[k], re_k + at, x + at);
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    const double *re_k = re + static_cast<std::ptrdiff_t>(k) * n, *im_k = im + static_cast<std::ptrdiff_t>(k) * n;
    if constexpr (complex) {
      const double r = x[k] * re_k[k] - y[k] * im_k[k], m = x[k] * im_k[k] + y[k] * re_k[k];
      x[k] = r, y[k] = m;
      subtract(k, {r, m}, re_k, im_k, x, y);
    } else {
      x[k] *= re_k[k];
      add(k, -x[k], re_k, x);
    }
  }
}

}  // namespace

// (12.22): 1 - mu W_w - mu^2 W_x X_w for mu = h lambda.
bool RadauIIA::factorize(double h) {
  ++factorizations_;
  const int w = system_.rates;
  factors_known_ = false;
  for (int k = 0; k < 3; ++k) {
    Factors& f = factors_[k];
    const double re = h * tableau().lambda_re[k], im = h * tableau().lambda_im[k];
    const double re2 = re * re - im * im, im2 = 2 * re * im;
    for (int i = 0; i < w * w; ++i) f.re[i] = -re * W_w_[i] - re2 * curvature_[i];
    for (int i = 0; i < w; ++i) f.re[i * w + i] += 1;
    if (k > 0) {
      for (int i = 0; i < w * w; ++i) f.im[i] = -im * W_w_[i] - im2 * curvature_[i];
    }
    const bool regular = k == 0 ? decompose<false>(w, f.re.data(), f.im.data(), f.pivot.data())
                                : decompose<true>(w, f.re.data(), f.im.data(), f.pivot.data());
    if (!regular) return false;
  }
  factored_for_ = h;
  factors_known_ = true;
  return true;
}

// Extrapolates the last step's polynomial; `from`: begin of the step on it, in its lengths. Numbers at rest keep their
// values.
void RadauIIA::predict(double h, double from) {
  const double ratio = length_ > 0 ? h / length_ : 0;
  if (!(ratio > 0 && ratio <= kMaxExtrapolation)) {
    std::fill(Z_.begin(), Z_.end(), 0.0);
    std::fill(extrapolated_.begin(), extrapolated_.end(), 0.0);
    return;
  }
  const int n = system_.coupled();
  const std::array<double, kStages> at_begin = basis(from);
  for (int i = 0; i < kStages; ++i) {
    std::array<double, kStages> L = basis(from + tableau().c[i] * ratio);
    double* const z = stage(Z_, i);
    std::fill_n(z, n, 0.0);
    for (int j = 0; j < kStages; ++j) {
      const double share = L[j] - at_begin[j];
      const double* const last = stage(last_Z_, j);
      for (int k = 0; k < n; ++k) z[k] += share * last[k];
    }
    if (at_rest_.empty()) continue;
    std::copy_n(z, n, stage(extrapolated_, i));
    for (int k = 0; k < n; ++k) z[k] = at_rest_[k] ? 0 : z[k];
  }
}

// Solved stages => the numbers whose extrapolation was farther from them than the value at the begin. At rest stages
// differ by rounding errors alone, which extrapolation magnifies.
void RadauIIA::note_rest() {
  for (std::size_t k = 0; k < at_rest_.size(); ++k) {
    double change = 0, error = 0;
    for (int i = 0; i < kStages; ++i) {
      const double z = stage(Z_, i)[k];
      change = std::max(change, std::abs(z));
      error = std::max(error, std::abs(z - stage(extrapolated_, i)[k]));
    }
    at_rest_[k] = change < error;
  }
}

double RadauIIA::weighted(std::span<const double> x) const {
  double largest = 0, sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += 0 * x[i];
    largest = std::max(largest, std::abs(x[i]) / tolerances_[i]);
  }
  return sum == 0 ? largest : std::numeric_limits<double>::infinity();
}

// Overwrites R with the correction of Z.
void RadauIIA::correct(double h) {
  const Tableau& T = tableau();
  const int x = system_.positions, w = system_.rates;
  for (int i = 0; i < kStages; ++i) {  // the right-hand side of (12.21)
    double* const s = stage(scratch_, i);
    std::fill_n(s, x, 0.0);
    for (int j = 0; j < kStages; ++j) add(x, T.a(i, j), stage(R_, j), s);
    add_product(h, W_x_, {s, static_cast<std::size_t>(x)}, stage(R_, i) + x, w);
  }
  for (int i = 0; i < kStages; ++i) std::fill_n(stage(scratch_, i) + x, w, 0.0);
  for (int f = 0; f < 3; ++f) {  // (12.22)
    std::fill(re_.begin(), re_.end(), 0.0), std::fill(im_.begin(), im_.end(), 0.0);
    for (int i = 0; i < kStages; ++i) {
      const double* const r = stage(R_, i) + x;
      add(w, T.w_re[f][i], r, re_.data());
      if (f > 0) add(w, T.w_im[f][i], r, im_.data());
    }
    const Factors& m = factors_[f];
    if (f == 0) {
      solve<false>(w, m.re.data(), m.im.data(), m.pivot.data(), re_.data(), im_.data());
    } else {
      solve<true>(w, m.re.data(), m.im.data(), m.pivot.data(), re_.data(), im_.data());
    }
    const double twice = f == 0 ? 1 : 2;
    for (int i = 0; i < kStages; ++i) {
      double* const d = stage(scratch_, i) + x;
      add(w, twice * T.v_re[f][i], re_.data(), d);
      if (f > 0) add(w, -twice * T.v_im[f][i], im_.data(), d);
    }
  }
  for (int i = 0; i < kStages; ++i) {  // (12.20)
    std::fill(sum_.begin(), sum_.begin() + w, 0.0);
    for (int j = 0; j < kStages; ++j) add(w, T.a(i, j), stage(scratch_, j) + x, sum_.data());
    double* const r = stage(R_, i);
    add_product(h, X_w_, {sum_.data(), static_cast<std::size_t>(w)}, r, x);
    std::copy_n(stage(scratch_, i) + x, w, r + x);
  }
}

bool RadauIIA::evaluate_stages(double h) {
  const std::size_t n = system_.size();
  for (int i = 0; i < kStages; ++i) {
    double* const moved = stage(moved_, i);
    std::copy(y_begin_.begin(), y_begin_.end(), moved);
    const double* const z = stage(Z_, i);
    for (int k = 0; k < system_.coupled(); ++k) moved[k] += z[k];
    times_[i] = begin_ + tableau().c[i] * h;
  }
  return evaluate({times_.data(), kStages}, {moved_.data(), kStages * n}, F_);
}

// Step size => stage increments Z by the simplified Newton iteration (12.19) to (12.22); monitors the contraction rate.
RadauIIA::Newton RadauIIA::solve_stages(double h) {
  const Tableau& T = tableau();
  const int n = system_.coupled();
  double before = 0, ratio_before = 0, theta = 0;
  slow_ = false;
  double factor = std::pow(std::max(contraction_, 1e-16), 0.8);  // remaining error relative to the last correction
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    ++iterations_;
    if (!evaluate_stages(h)) return Newton::failed;
    for (int i = 0; i < kStages; ++i) {  // (12.19)
      double* const r = stage(R_, i);
      const double* const z = stage(Z_, i);
      for (int k = 0; k < n; ++k) r[k] = -z[k];
      for (int j = 0; j < kStages; ++j) add(n, h * T.a(i, j), stage(F_, j), r);
    }
    correct(h);
    double size = 0;
    for (int i = 0; i < kStages; ++i) {
      double* const z = stage(Z_, i);
      const double* const r = stage(R_, i);
      for (int k = 0; k < n; ++k) z[k] += r[k];
      size = std::max(size, weighted({r, static_cast<std::size_t>(n)}));
    }
    if (!std::isfinite(size)) return Newton::failed;
    iterations_now_ = iteration + 1;
    if (iteration > 0) {
      const double ratio = size / before;
      theta = iteration == 1 ? ratio : std::sqrt(ratio * ratio_before);
      ratio_before = ratio;
      if (!(theta < 0.99)) return size < rounding_ ? Newton::converged : Newton::failed;
      factor = theta / (1 - theta);
      slow_ = theta > kSlow;
    }
    contraction_ = factor;
    if (factor * size <= newton_share_ || size == 0) return Newton::converged;
    if (iteration > 0 && factor * size * std::pow(theta, kMaxIterations - 1 - iteration) > newton_share_)
      return Newton::failed;  // predicted number of iterations exceeds the limit
    before = size;
  }
  return Newton::failed;
}

// Quadratures. The iteration's last derivatives precede its last correction, which may be much larger than the
// remaining error, so they are evaluated again; those at the end are also the first of the next step.
bool RadauIIA::add_quadratures(double h) {
  if (!evaluate_stages(h)) return false;
  for (int i = 0; i < kStages; ++i) {
    double* const z = stage(Z_, i);
    for (int k = system_.coupled(); k < system_.size(); ++k) {
      z[k] = 0;
      for (int j = 0; j < kStages; ++j) z[k] += h * tableau().a(i, j) * stage(F_, j)[k];
    }
  }
  return true;
}

// Error estimate (12.23) relative to the tolerances; `slope`: derivative at the begin, or close to it.
double RadauIIA::error_of(double h, std::span<const double> slope) {
  const Tableau& T = tableau();
  const int x = system_.positions, w = system_.rates, n = x + w;
  const auto estimated = static_cast<int>(tolerances_.size());
  const double mu = h * T.gamma0;
  for (int k = 0; k < estimated; ++k) sum_[k] = mu * slope[k];
  for (int i = 0; i < kStages; ++i) {
    const double* const z = stage(Z_, i);
    for (int k = 0; k < estimated; ++k) sum_[k] += T.e[i] * z[k];
  }
  add_product(mu, W_x_, {sum_.data(), static_cast<std::size_t>(x)}, sum_.data() + x, w);
  const Factors& f = factors_[0];
  solve<false>(w, f.re.data(), f.im.data(), f.pivot.data(), sum_.data() + x, nullptr);
  add_product(mu, X_w_, {sum_.data() + x, static_cast<std::size_t>(w)}, sum_.data(), x);
  double error = weighted({sum_.data(), static_cast<std::size_t>(n)});
  if (limits_quadratures() && std::isfinite(error)) error = std::max(error, error_of_quadratures(h));
  return error;
}

// Errors of the coupled numbers, and (12.23) without them of quadratures, both in sum_ => the largest quotient of a
// quadrature's error (8.1d) and its tolerance (8.1f).
double RadauIIA::error_of_quadratures(double h) {
  const auto n = static_cast<std::size_t>(system_.coupled());
  const int count = system_.quadratures;
  double* const errors = sum_.data() + n;
  add_product(h * tableau().gamma0, G_, {sum_.data(), n}, errors, count);
  double largest = 0, sum = 0;
  for (int k = 0; k < count; ++k) {
    double rate = 0;  // changes by this if the coupled numbers change by their tolerances
    for (std::size_t j = 0; j < n; ++j)
      rate += std::abs(G_[j * static_cast<std::size_t>(count) + static_cast<std::size_t>(k)]) * tolerances_[j];
    sum += 0 * errors[k];
    largest = std::max(largest, std::abs(errors[k]) / (tolerances_[n + k] + h * newton_share_ * rate));
  }
  return sum == 0 ? largest : std::numeric_limits<double>::infinity();
}

// Completes the step with the stages Z.
void RadauIIA::finish(double h, double t_end) {
  const double* const last = stage(Z_, kStages - 1);
  for (int k = 0; k < system_.size(); ++k) y_[k] = y_begin_[k] + last[k];
  const double* const slope = stage(F_, kStages - 1);
  std::copy(slope, slope + system_.size(), end_slope_.begin());
  slope_known_ = true;
  Z_.swap(last_Z_);
  t_ = t_end, length_ = h;
  derivatives_fresh_ = false;
}

void RadauIIA::restart(double first_step) {
  proposed_ = first_step;
  derivatives_known_ = slope_known_ = false;
  last_error_ = 0;
  contraction_ = 1;
}

void RadauIIA::continue_from(double t, std::span<const double> y, std::span<const double> slope) {
  std::copy(y.begin(), y.end(), y_.begin());
  std::copy(slope.begin(), slope.end(), end_slope_.begin());
  t_ = t;
  slope_known_ = true;
}

void RadauIIA::expect_rest(double share) {
  newton_share_ = share;
  at_rest_.assign(static_cast<std::size_t>(system_.coupled()), false);
  extrapolated_.assign(Z_.size(), 0.0);
}

void RadauIIA::limit_quadratures(std::span<const double> tolerances) {
  const auto coupled = static_cast<std::size_t>(system_.coupled());
  tolerances_.resize(coupled);
  tolerances_.insert(tolerances_.end(), tolerances.begin(), tolerances.end());
  G_.assign(coupled * tolerances.size(), 0.0);
}

void RadauIIA::set_tolerances(std::span<const double> tolerances) {
  std::copy_n(tolerances.begin(), std::min(tolerances.size(), tolerances_.size()), tolerances_.begin());
}

// Jacobian [0 X_w; W_x W_w] => (|J^k p|/|p|)^(1/k). An even k suits pairs of complex eigenvalues.
double RadauIIA::spectral_radius() {
  constexpr int kProducts = 8;
  if (jacobians_ == 0) return 0;
  const auto x = static_cast<std::size_t>(system_.positions), w = static_cast<std::size_t>(system_.rates);
  if (power_.empty()) {
    next_power_.resize(x + w);
    for (std::size_t i = 0; i < x + w; ++i) power_.push_back(1 + 0.5 * std::sin(static_cast<double>(i + 1)));
  }
  double logarithm = 0;
  for (int k = 0; k < kProducts; ++k) {
    std::fill(next_power_.begin(), next_power_.end(), 0.0);
    const std::span<const double> at_x(power_.data(), x), at_w(power_.data() + x, w);
    add_product(1, X_w_, at_w, next_power_.data(), system_.positions);
    add_product(1, W_x_, at_x, next_power_.data() + x, system_.rates);
    add_product(1, W_w_, at_w, next_power_.data() + x, system_.rates);
    double before = 0, after = 0;
    for (std::size_t i = 0; i < x + w; ++i) before += power_[i] * power_[i], after += next_power_[i] * next_power_[i];
    if (!(after > 0 && std::isfinite(after))) {
      power_.clear();
      return 0;
    }
    logarithm += 0.5 * std::log(after / before);
    const double by = 1 / std::sqrt(after);
    for (std::size_t i = 0; i < x + w; ++i) power_[i] = by * next_power_[i];
  }
  return std::exp(logarithm / kProducts);
}

// Makes one step up to `limit`: predicts, solves the stages, estimates the error and adapts the size until a trial is
// accepted. False after too many attempts.
bool RadauIIA::step(double limit) {
  std::copy(y_.begin(), y_.end(), y_begin_.begin());
  begin_ = t_;
  if (slope_known_) {
    slope_.swap(end_slope_);
  } else if (!evaluate({&begin_, 1}, y_begin_, slope_)) {
    return fail("the right side is not finite");
  }
  slope_known_ = false;
  bool rejected = false;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    double h = longest_ > 0 ? std::min(proposed_, longest_) : proposed_, t_end = begin_ + h;
    const double left = limit - begin_;
    const bool cut = h > 0.5 * left;
    if (h >= left * (1 - 1e-9)) {
      h = left, t_end = limit;
    } else if (cut) {  // two equal steps instead of a tiny last one
      h = 0.5 * left, t_end = begin_ + h;
    }
    if (!(begin_ + h > begin_)) break;
    if (!derivatives_known_) difference();
    if (!factors_known_ || std::abs(h - factored_for_) > kSameLength * h) {
      if (!factorize(h)) {
        proposed_ = 0.5 * h;
        ++rejected_;
        continue;
      }
    }
    predict(h, 1);
    if (solve_stages(h) != Newton::converged || !add_quadratures(h)) {
      rejected = true;
      ++rejected_;
      contraction_ = 1;
      if (derivatives_fresh_) proposed_ = 0.5 * h;
      derivatives_known_ = derivatives_fresh_;
      continue;
    }
    double error = error_of(h, slope_);
    if (error >= 1) {  // repeated filtering, which removes the stiff components
      for (int k = 0; k < system_.coupled(); ++k) moved_[k] = y_begin_[k] + sum_[k];
      std::copy(y_begin_.begin() + system_.coupled(), y_begin_.end(), moved_.begin() + system_.coupled());
      if (evaluate({&begin_, 1}, {moved_.data(), y_.size()}, moved_slope_)) error = error_of(h, moved_slope_);
    }
    const double safety = 0.9 * (2 * kMaxIterations + 1) / (2 * kMaxIterations + iterations_now_);
    const double small = std::max(error, 1e-12);
    double growth = safety * std::pow(small, -kOrder);
    if (!(error < 1)) {
      rejected = true;
      ++rejected_;
      proposed_ = h * std::clamp(growth, kMaxShrinking, 0.9);
      continue;
    }
    if (last_error_ > 0)  // [Gustafsson 1994]: extrapolates the change of the error from the last step to this one
      growth = std::min(growth, safety * h / last_length_ * std::pow(last_error_ / (small * small), kOrder));
    growth = std::clamp(growth, kMaxShrinking, rejected ? 1.0 : kMaxGrowth);
    last_error_ = std::max(small, 1e-2), last_length_ = h;
    if (slow_) derivatives_known_ = false;
    if (growth > 1 && growth < 1.2 && derivatives_known_) growth = 1;  // reuses the factors
    proposed_ = cut && !rejected ? std::max(proposed_, growth * h) : growth * h;
    note_rest();
    finish(h, t_end);
    return true;
  }
  message_ = fmt::format("no step succeeds, down to one of {:.3g} s", proposed_);
  return false;
}

// Repeats the last step with its end at t: predicts from its polynomial and solves the stages. At t = begin() the state
// at the begin is restored.
bool RadauIIA::end_at(double t) {
  const double h = t - begin_;
  if (!(t > begin_)) {
    std::copy(y_begin_.begin(), y_begin_.end(), y_.begin());
    std::fill(last_Z_.begin(), last_Z_.end(), 0.0);
    t_ = begin_, length_ = 0;
    slope_known_ = false;
    return true;
  }
  if (!factorize(h)) return fail("the step to an event cannot be solved");
  predict(h, 0);
  contraction_ = 1;
  if (solve_stages(h) != Newton::converged) {
    difference();
    if (!factorize(h)) return fail("the step to an event cannot be solved");
    std::fill(Z_.begin(), Z_.end(), 0.0);
    if (solve_stages(h) != Newton::converged) return fail("the step to an event cannot be solved");
  }
  if (!add_quadratures(h)) return fail("the right side is not finite");
  finish(h, t);
  return true;
}

void RadauIIA::at(double t, std::span<double> y) const {
  if (t == t_ || !(length_ > 0)) {
    std::copy(y_.begin(), y_.end(), y.begin());
    return;
  }
  std::copy(y_begin_.begin(), y_begin_.end(), y.begin());
  const std::array<double, kStages> L = basis((t - begin_) / length_);
  for (int i = 0; i < kStages; ++i) {
    add(system_.size(), L[i], stage(last_Z_, i), y.data());
  }
}

double RadauIIA::time_of_stage(int i) const {
  return i == kStages - 1 ? t_ : begin_ + tableau().c[i] * length_;  // the last stage is exactly the step's end
}

}  // namespace grapnel
