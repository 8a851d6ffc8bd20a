#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "grapnel/compare/chi_square.hpp"
#include "grapnel/compare/log_fitter.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr double kNormal95 = 1.959964;         // two-sided 95 % quantile of the normal distribution
constexpr double kPriorBound = 4;              // standard uncertainties of a prior between it and the fit
constexpr double kDriftShare = 0.2;            // largest uncertainty of a determined drift, of its largest magnitude
constexpr double kLeastSingular = 4;           // a standard uncertainty of a quarter of the range
constexpr double kDerivativeError = 3;         // smallest singular value, in errors of the derivative
constexpr double kNullShare = 0.05;            // part of a parameter in combinations that are not identifiable
constexpr double kUniformVariance = 1 / 12.0;  // of a uniform distribution between the bounds
constexpr double kPriorShare = 0.95;           // of a prior uncertainty that remains
constexpr double kCorrelated = 0.1;            // autocorrelation of residuals

ChiSquare chi_square_of(double value, double numbers) {
  return {value, numbers, numbers >= 1 ? chi_square_bound(numbers) : 0};
}

// The inverse of a symmetric matrix with separate scales; directions without information stay zero.
Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& A) {
  const Eigen::Index n = A.rows();
  Eigen::VectorXd d(n);
  for (Eigen::Index k = 0; k < n; ++k) d[k] = A(k, k) > 0 ? 1 / std::sqrt(A(k, k)) : 0;
  const Eigen::MatrixXd scaled = d.asDiagonal() * A * d.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  Eigen::VectorXd inverse = eigen.eigenvalues();
  for (double& x : inverse) x = x > 1e-13 ? 1 / x : 0;
  return d.asDiagonal() * eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose() *
         d.asDiagonal();
}

// The columns of the parameters without the part that the clocks of the logs explain, and the priors.
Eigen::MatrixXd without_clocks(const Derivatives& d, Eigen::Index parameters) {
  const Eigen::Index local = d.white.cols() - parameters;
  Eigen::MatrixXd S = d.white.leftCols(parameters);
  std::vector<Eigen::Index> used;
  for (Eigen::Index k = 0; k < local; ++k) {
    if (d.white.col(parameters + k).norm() > 0) used.push_back(parameters + k);
  }
  if (used.empty()) return S;
  Eigen::MatrixXd clocks(S.rows(), static_cast<Eigen::Index>(used.size()));
  for (std::size_t k = 0; k < used.size(); ++k)
    clocks.col(static_cast<Eigen::Index>(k)) = d.white.col(used[k]).normalized();
  const Eigen::MatrixXd Q = thin_qr(clocks).Q;
  return S - Q * (Q.transpose() * S);
}

class Statistics {
 public:
  Statistics(const LogFitProblem& problem, LogFitter& fitter, const Eigen::VectorXd& x, LogFit& fit)
      : problem_(problem), fitter_(fitter), x_(x), fit_(fit), n_(static_cast<Eigen::Index>(fitter.parameters())) {}

  void evaluate(bool converged) {
    const auto residuals = fitter_.residuals(x_);
    auto derivatives = fitter_.derivatives(x_, true);
    fit_.best = fitter_.values_of(x_), fit_.converged = converged && derivatives.has_value();
    for (const double value : fit_.best) fit_.parameters.emplace_back().value = value;
    find_held(derivatives);
    runs_ = fitter_.run(x_);
    set_logs(*residuals);
    if (derivatives) {
      hold_clocks(*derivatives);
      find_combinations(*derivatives);
      set_covariance(*derivatives);
      set_parameters();
      set_clocks();
      set_biases(*residuals, *derivatives);
    } else {
      fit_.warnings.push_back("runs beside the best values fail, so that no uncertainty is computed");
    }
    set_chi_square(residuals->white.squaredNorm());
    set_intervals();
  }

 private:
  // Variables at a bound do not vary. One without effect on the logs is there by chance, so it is not held.
  void find_held(const std::optional<Derivatives>& d) {
    const auto [lower, upper] = fitter_.bounds();
    for (Eigen::Index k = n_; k < x_.size(); ++k) held_clocks_.push_back(x_[k] <= lower[k] || x_[k] >= upper[k]);
    for (Eigen::Index k = 0; k < n_; ++k) {
      ParameterStatus& status = fit_.parameters[static_cast<std::size_t>(k)].status;
      const bool acts = !d || d->white.col(k).norm() > kLeastSingular;
      if (x_[k] <= 0 && acts) status = ParameterStatus::at_lower_bound;
      if (x_[k] >= 1 && acts) status = ParameterStatus::at_upper_bound;
      if (!acts || (x_[k] > 0 && x_[k] < 1)) free_.push_back(k);
    }
  }

  bool is_held_clock(Eigen::Index k) const { return k >= n_ && held_clocks_[static_cast<std::size_t>(k - n_)]; }

  void hold_clocks(Derivatives& d) const {
    for (Eigen::Index k = n_; k < x_.size(); ++k) {
      if (is_held_clock(k)) d.white.col(k).setZero(), d.means.col(k).setZero();
    }
  }

  // The singular values of the scaled derivatives (26.8), and which exceed their error.
  void find_combinations(const Derivatives& d) {
    const Eigen::MatrixXd S = without_clocks(d, n_);
    const auto m = static_cast<Eigen::Index>(free_.size());
    if (m == 0) return;
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(std::max(S.rows(), m), m), errors = columns;
    for (Eigen::Index i = 0; i < m; ++i) {
      columns.col(i).head(S.rows()) = S.col(free_[static_cast<std::size_t>(i)]);
      errors.col(i).head(S.rows()) = d.error.col(free_[static_cast<std::size_t>(i)]);
    }
    const Eigen::MatrixXd R = thin_qr(columns).R;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(R, Eigen::ComputeFullV);
    for (Eigen::Index i = 0; i < m; ++i) {
      ParameterCombination& one = fit_.combinations.emplace_back();
      const Eigen::VectorXd v = svd.matrixV().col(i);
      one.singular_value = svd.singularValues()[i];
      one.is_identifiable = one.singular_value > std::max(kLeastSingular, kDerivativeError * (errors * v).norm());
      one.direction.assign(static_cast<std::size_t>(n_), 0.0);
      for (Eigen::Index k = 0; k < m; ++k)
        one.direction[static_cast<std::size_t>(free_[static_cast<std::size_t>(k)])] = v[k];
    }
  }

  // (26.7) of all variables. Combinations that are not identifiable have the variance of a uniform distribution between
  // the bounds instead.
  void set_covariance(const Derivatives& d) {
    Eigen::MatrixXd information = d.white.transpose() * d.white;
    for (const ParameterCombination& one : fit_.combinations) {
      if (one.is_identifiable) continue;
      const Eigen::VectorXd v = as_vector(one.direction);
      information.topLeftCorner(n_, n_) +=
          (1 / kUniformVariance - one.singular_value * one.singular_value) * v * v.transpose();
    }
    for (Eigen::Index k = 0; k < n_; ++k) {
      if (std::find(free_.begin(), free_.end(), k) != free_.end()) continue;
      information.row(k).setZero(), information.col(k).setZero();
    }
    covariance_ = scaled_inverse(information);
    information_ = information.diagonal();
  }

  double null_share(Eigen::Index k) const {
    double sum = 0;
    for (const ParameterCombination& one : fit_.combinations) {
      if (!one.is_identifiable) sum += std::pow(one.direction[static_cast<std::size_t>(k)], 2);
    }
    return std::sqrt(sum);
  }

  void set_parameters() {
    for (const Eigen::Index k : free_) {
      const auto i = static_cast<std::size_t>(k);
      ParameterEstimate& one = fit_.parameters[i];
      const double share = std::sqrt(covariance_(k, k));
      if (null_share(k) > kNullShare || !(share > 0) || share > 1 / kLeastSingular) continue;
      one.uncertainty = std::abs(fitter_.slope_of(i, x_[k])) * share;
      const auto& prior = problem_.parameters[i].uncertainty;
      one.status =
          prior && *one.uncertainty > kPriorShare * *prior ? ParameterStatus::from_prior : ParameterStatus::identified;
      fit_.in_covariance.push_back(i);
    }
    const auto m = static_cast<Eigen::Index>(fit_.in_covariance.size());
    fit_.covariance.resize(m, m);
    for (Eigen::Index i = 0; i < m; ++i) {
      for (Eigen::Index k = 0; k < m; ++k) {
        const std::size_t a = fit_.in_covariance[static_cast<std::size_t>(i)],
                          b = fit_.in_covariance[static_cast<std::size_t>(k)];
        const auto ia = static_cast<Eigen::Index>(a), ib = static_cast<Eigen::Index>(b);
        fit_.covariance(i, k) = covariance_(ia, ib) * fitter_.slope_of(a, x_[ia]) * fitter_.slope_of(b, x_[ib]);
      }
    }
  }

  void set_logs(const StackedResiduals& residuals) {
    const std::vector<LogClock> clocks = fitter_.clocks_of(x_);
    Eigen::Index white = 0;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      LogEstimate& log = fit_.logs.emplace_back();
      log.clock = clocks[i];
      Eigen::Index size = 0;
      if (const auto one = white_residuals(*runs_[i], clocks[i], fitter_.selections()[i])) size = one->white.size();
      log.chi_square = chi_square_of(residuals.white.segment(white, size).squaredNorm(),
                                     independent_numbers(*runs_[i], fitter_.selections()[i]));
      white += size;
      compare(i, log);
    }
  }

  // Compares as `grapnel compare` does, free biases removed.
  void compare(std::size_t i, LogEstimate& log) {
    Quantities quantities = *runs_[i];
    const auto white = white_residuals(*runs_[i], log.clock, fitter_.selections()[i]);
    const std::vector<MeanOf> means = means_of(quantities, fitter_.selections()[i]);
    for (std::size_t k = 0; k < means.size() && white; ++k) {
      ComparedQuantity& quantity = quantities[means[k].quantity];
      if (std::isfinite(quantity.bias_uncertainty.value_or(0)) || quantity.is_orientation) continue;
      const std::size_t width = quantity.curve.width();
      for (std::size_t s = means[k].component; s < quantity.measured.size(); s += width)
        quantity.measured[s] -= white->means[static_cast<Eigen::Index>(k)];
    }
    for (ComparedQuantity& quantity : quantities) {
      if (std::isfinite(quantity.bias_uncertainty.value_or(0))) continue;
      // The free bias of an orientation remains in its residuals. It is at most half a turn.
      quantity.bias_uncertainty = quantity.is_orientation ? std::optional(std::numbers::pi) : std::nullopt;
    }
    const FittedLog& fitted = problem_.logs[fitter_.logs()[i]];
    ComparisonReport::Clock& clock = log.comparison.report.clock;
    clock.offset = log.clock.offset, clock.found = fitted.fits_offset;
    clock.drift = log.clock.drift, clock.drift_found = fitted.fits_drift;
    if (clock.drift != 0 || fitted.fits_drift) clock.reference = log.clock.reference;
    evaluate_residuals(quantities, fitted.times, log.comparison);
  }

  std::optional<double> deviation(Eigen::Index variable) const {
    if (variable < 0 || !(information_[variable] > 0)) return std::nullopt;
    return std::sqrt(covariance_(variable, variable));
  }

  void set_clocks() {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      LogEstimate& log = fit_.logs[i];
      const auto [offset, drift] = fitter_.clock_variables(fitter_.logs()[i]);
      log.offset_uncertainty = deviation(offset), log.drift_uncertainty = deviation(drift);
      log.comparison.report.clock.uncertainty = log.offset_uncertainty;
      const std::string& name = problem_.logs[fitter_.logs()[i]].name;
      if (is_held_clock(offset))
        fit_.warnings.push_back(
            fmt::format("{}: the offset of the clock, {} s, is at an end of its search: other values are computed with "
                        "this offset; widen time.search",
                        printable_line(name), short_number(log.clock.offset)));
      const double largest = problem_.logs[fitter_.logs()[i]].largest_drift;
      if (log.drift_uncertainty.value_or(0) > kDriftShare * largest)
        fit_.warnings.push_back(fmt::format(
            "{}: the drift of the clock is not determined: its standard uncertainty of {:.3g} ppm exceeds a "
            "fifth of the largest drift, {:.3g} ppm; other uncertainties contain it",
            printable_line(name), 1e6 * *log.drift_uncertainty, 1e6 * largest));
      if (is_held_clock(drift))
        fit_.warnings.push_back(
            fmt::format("{}: the drift of the clock, {}, is at its bound: other values are computed with this drift",
                        printable_line(name), short_number(log.clock.drift)));
      if (offset >= 0 && !is_held_clock(offset) && !log.offset_uncertainty)
        fit_.warnings.push_back(fmt::format("{}: the offset of the clock is not determined", printable_line(name)));
    }
  }

  // The expected bias given its prior, with the uncertainty of the fit (26.9).
  void set_biases(const StackedResiduals& residuals, const Derivatives& d) {
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      for (const MeanOf& mean : means_of(*runs_[i], fitter_.selections()[i])) {
        const ComparedQuantity& quantity = (*runs_[i])[mean.quantity];
        const Eigen::Index at = row++;
        const double s2 = std::pow(*quantity.uncertainty, 2), b = quantity.bias_uncertainty.value_or(0);
        if (!(b > 0) || mean.samples == 0) continue;
        const double share = std::isfinite(b) ? mean.samples * b * b / (s2 + mean.samples * b * b) : 1;
        const Eigen::VectorXd slope = d.means.row(at).transpose();
        const double variance = share * s2 / mean.samples + share * share * slope.dot(covariance_ * slope);
        fit_.logs[i].biases.push_back({quantity.name, quantity.components[mean.component], quantity.unit,
                                       share * residuals.means[at], std::sqrt(variance)});
      }
    }
  }

  void set_chi_square(double value) {
    double numbers = static_cast<double>(fitter_.priors());
    for (const LogEstimate& log : fit_.logs) numbers += log.chi_square.numbers;
    for (const ParameterCombination& one : fit_.combinations) numbers -= one.is_identifiable ? 1 : 0;
    for (Eigen::Index k = n_; k < x_.size(); ++k) numbers -= is_held_clock(k) ? 0 : 1;
    fit_.chi_square = chi_square_of(value, numbers);
    judge();
  }

  void judge() {
    const ChiSquare& c = fit_.chi_square;
    if (c.numbers < 1) {
      fit_.reason = "not checked, since the logs have no more numbers than the fit has variables";
      return;
    }
    if (!fit_.converged) {
      fit_.reason = "not checked, since the search did not converge";
      return;
    }
    fit_.agrees = c.agrees() ? Verdict::yes : Verdict::no;
    fit_.reason = fmt::format("chi-square per degree of freedom {} is {} {}", small_number(c.per_number()),
                              c.agrees() ? "within" : "above the bound", small_number(c.bound));
    for (std::size_t i = 0; i < fit_.parameters.size(); ++i) {
      const FittedParameter& one = problem_.parameters[i];
      const double apart = one.uncertainty ? std::abs(fit_.best[i] - one.start) / *one.uncertainty : 0;
      if (apart <= kPriorBound * (1 + kStatedAccuracy)) continue;
      fit_.agrees = Verdict::no;
      fit_.reason += fmt::format("; {} is {} standard uncertainties of its prior from start", printable_line(one.name),
                                 small_number(apart));
    }
    for (std::size_t i = 0; i < fit_.logs.size(); ++i) {
      const std::string& name = problem_.logs[fitter_.logs()[i]].name;
      for (const ComparisonReport::Quantity& q : fit_.logs[i].comparison.report.quantities) {
        const double noise = 4 / std::sqrt(std::max(static_cast<double>(q.compared * q.components.size()), 1.0));
        if (q.uncertainty && std::abs(q.autocorrelation) > std::max(kCorrelated, noise))
          fit_.warnings.push_back(
              fmt::format("{}: the residuals of {} are correlated, autocorrelation {}: the noise is not white, or the "
                          "model is wrong; uncertainties assume white noise",
                          printable_line(name), printable_line(q.name), small_number(q.autocorrelation)));
        if (q.verdict != Verdict::no) continue;
        fit_.agrees = Verdict::no;
        fit_.reason += fmt::format("; {} of {} disagrees", printable_line(q.name), printable_line(name));
      }
    }
    const bool has_held_clock = std::find(held_clocks_.begin(), held_clocks_.end(), true) != held_clocks_.end();
    if (!has_held_clock || fit_.agrees != Verdict::yes) return;
    fit_.agrees = Verdict::not_checked;
    fit_.reason += "; not checked, since a clock is at an end of its search";
  }

  void set_intervals() {
    if (fit_.agrees != Verdict::yes) return;
    for (std::size_t i = 0; i < fit_.parameters.size(); ++i) {
      ParameterEstimate& one = fit_.parameters[i];
      if (!one.uncertainty) continue;
      const double half = kNormal95 * *one.uncertainty;
      if (problem_.parameters[i].is_logarithmic) {
        const double factor = std::exp(half / one.value);
        one.interval = {one.value / factor, one.value * factor};
      } else {
        one.interval = {one.value - half, one.value + half};
      }
    }
  }

  const LogFitProblem& problem_;
  LogFitter& fitter_;
  const Eigen::VectorXd& x_;
  LogFit& fit_;
  Eigen::Index n_;
  std::vector<Eigen::Index> free_;
  std::vector<bool> held_clocks_;  // at an end of the search, per variable after the parameters
  RunsOfLogs runs_;
  Eigen::MatrixXd covariance_;   // of all variables
  Eigen::VectorXd information_;  // its inverse's diagonal
};

// What a fit to other logs knows, for the log that it left out.
struct Prediction {
  Eigen::MatrixXd information;  // of the parameters
  double fitted = 0;            // directions that only the left-out log determines
};

// Directions that the fit does not determine but the left-out log does are fitted to that log. The others are uniform
// between the bounds, as in the covariance.
Prediction prediction_of(const Eigen::MatrixXd& training, const Eigen::MatrixXd& left_out) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(training);
  const Eigen::Index n = training.rows();
  Prediction result{Eigen::MatrixXd::Zero(n, n), 0};
  Eigen::Index unknown = 0;  // the eigenvalues ascend
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::VectorXd v = eigen.eigenvectors().col(k);
    if (eigen.eigenvalues()[k] > kLeastSingular * kLeastSingular)
      result.information += eigen.eigenvalues()[k] * v * v.transpose();
    else
      ++unknown;
  }
  if (unknown == 0) return result;
  const Eigen::MatrixXd V = eigen.eigenvectors().leftCols(unknown), T = left_out * V;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> there(T.transpose() * T);
  for (Eigen::Index k = 0; k < unknown; ++k) {
    const Eigen::VectorXd v = V * there.eigenvectors().col(k);
    if (there.eigenvalues()[k] > kLeastSingular * kLeastSingular)
      result.fitted += 1;
    else
      result.information += v * v.transpose() / kUniformVariance;
  }
  return result;
}

// Chi-square of the residuals of a log under the uncertain values of a fit to others (26.10). Without numbers if the
// fit predicts none of the log.
std::optional<ChiSquare> predicted_chi_square(const Eigen::MatrixXd& training, LogFitter& left_out,
                                              const Eigen::VectorXd& x, Eigen::Index n) {
  const auto residuals = left_out.residuals(x);
  const auto d = left_out.derivatives(x, false);
  if (!residuals || !d) return std::nullopt;
  // The priors are part of the training.
  const Eigen::Index rows = residuals->white.size() - static_cast<Eigen::Index>(left_out.priors());
  const Eigen::MatrixXd J = d->white.topRows(rows);
  const Eigen::VectorXd r = residuals->white.head(rows);
  Eigen::MatrixXd total = J.transpose() * J;
  const Prediction prediction = prediction_of(training, without_clocks(*d, n).topRows(rows));
  total.topLeftCorner(n, n) += prediction.information;
  const Eigen::VectorXd g = J.transpose() * r;
  const double value = r.squaredNorm() - g.dot(scaled_inverse(total) * g);
  const auto runs = left_out.run(x);
  const double numbers = independent_numbers(*runs.front(), left_out.selections().front()) -
                         static_cast<double>(x.size() - n) - prediction.fitted;
  return chi_square_of(value, numbers);
}

void leave_out(const LogFitProblem& problem, const FitOptions& options, const LogFitter& all, const Eigen::VectorXd& x,
               std::size_t i, LogEstimate& log, LogFit& fit) {
  const Eigen::Index n = static_cast<Eigen::Index>(all.parameters());
  std::vector<std::size_t> others;
  std::vector<Selection> selections;
  std::vector<double> middles;
  for (std::size_t k = 0; k < problem.logs.size(); ++k) {
    if (k == i) continue;
    others.push_back(k), selections.push_back(all.selections()[k]), middles.push_back(all.middles()[k]);
  }
  LogFitter training(problem, others, options), left_out(problem, {i}, options);
  training.set_selection(selections, middles);
  left_out.set_selection({all.selections()[i]}, {all.middles()[i]});
  // Its variables, from those of the complete fit.
  const auto variables = [&](const LogFitter& of) {
    Eigen::VectorXd part = of.scaled(of.values_of(x));
    part.head(n) = x.head(n);
    for (const std::size_t k : of.logs()) {
      const auto [offset, drift] = of.clock_variables(k);
      const auto [whole_offset, whole_drift] = all.clock_variables(k);
      if (offset >= 0) part[offset] = x[whole_offset];
      if (drift >= 0) part[drift] = x[whole_drift];
    }
    return part;
  };
  const auto solution = training.search_selected(variables(training), selections);
  const bool converged = solution && solution->converged;
  const auto derivatives = converged ? training.derivatives(solution->x, false) : std::nullopt;
  if (derivatives) {
    Eigen::VectorXd there = variables(left_out);
    there.head(n) = solution->x.head(n);
    if (const auto clocks = left_out.fit_clocks(there)) there = clocks->x;
    const Eigen::MatrixXd S = without_clocks(*derivatives, n);
    log.left_out = predicted_chi_square(S.transpose() * S, left_out, there, n);
    log.left_out_values = training.values_of(solution->x);
  }
  if (solution && !converged)
    log.why_not_left_out = "the fit without this log did not converge";
  else if (!log.left_out)
    log.why_not_left_out = "runs of the fit without this log failed";
  else if (log.left_out->numbers < 1)
    log.left_out.reset(), log.why_not_left_out = "the fit without this log determines no value of it";
  fit.runs += training.runs + left_out.runs, fit.failed_runs += training.failed_runs + left_out.failed_runs;
}

}  // namespace

void evaluate_fit(const LogFitProblem& problem, LogFitter& fitter, const Eigen::VectorXd& x, bool converged,
                  LogFit& fit) {
  Statistics(problem, fitter, x, fit).evaluate(converged);
}

void cross_validate(const LogFitProblem& problem, const FitOptions& options, LogFitter& fitter,
                    const Eigen::VectorXd& x, LogFit& fit) {
  for (std::size_t i = 0; i < problem.logs.size(); ++i) leave_out(problem, options, fitter, x, i, fit.logs[i], fit);
}

}  // namespace grapnel
