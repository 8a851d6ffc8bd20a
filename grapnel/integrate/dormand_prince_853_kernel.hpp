#pragma once

/// @file
/// One step of the explicit Runge-Kutta method of order 8 by Dormand and Prince, with error estimators of order 5 and
/// 3: its coefficients, those of its dense output of order 7, the arithmetic of a step and the step size control.
/// Shared by the stepper of doubles (dormand_prince_853.hpp) and packs of SIMD lanes (grapnel/lanes/). Source: E.
/// Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993, II.5 and II.6,
/// with the digits published in the authors' program dop853 (University of Geneva). Stages are counted from 1 as in the
/// book. tests/integrate checks the order conditions.

#include <array>
#include <cmath>
#include <utility>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel::dop853 {

/// One entry of a row of the tableau: weight times the derivative at a stage.
struct Term {
  int stage;  // from 1
  double weight;
};

inline constexpr int kStages = 12;          // per step
inline constexpr int kExtendedStages = 16;  // 13: the derivative at the end of the step; 14 to 16: for dense output

// c_i: stage i is evaluated at t + c_i h. Entry i − 1.
inline constexpr std::array<double, kExtendedStages> kNodes = {0.0,
                                                               0.526001519587677318785587544488e-1,
                                                               0.789002279381515978178381316732e-1,
                                                               0.118350341907227396726757197510,
                                                               0.281649658092772603273242802490,
                                                               0.333333333333333333333333333333,
                                                               0.25,
                                                               0.307692307692307692307692307692,
                                                               0.651282051282051282051282051282,
                                                               0.6,
                                                               0.857142857142857142857142857142,
                                                               1.0,
                                                               1.0,
                                                               0.1,
                                                               0.2,
                                                               0.777777777777777777777777777778};

// a_ij: stage i is evaluated at y + h Σ_j a_ij k_j.
inline constexpr std::array kStage2 = {Term{1, 5.26001519587677318785587544488e-2}};

inline constexpr std::array kStage3 = {Term{1, 1.97250569845378994544595329183e-2},
                                       Term{2, 5.91751709536136983633785987549e-2}};

inline constexpr std::array kStage4 = {Term{1, 2.95875854768068491816892993775e-2},
                                       Term{3, 8.87627564304205475450678981324e-2}};

inline constexpr std::array kStage5 = {Term{1, 2.41365134159266685502369798665e-1},
                                       Term{3, -8.84549479328286085344864962717e-1},
                                       Term{4, 9.24834003261792003115737966543e-1}};

inline constexpr std::array kStage6 = {Term{1, 3.7037037037037037037037037037e-2},
                                       Term{4, 1.70828608729473871279604482173e-1},
                                       Term{5, 1.25467687566822425016691814123e-1}};

inline constexpr std::array kStage7 = {Term{1, 3.7109375e-2}, Term{4, 1.70252211019544039314978060272e-1},
                                       Term{5, 6.02165389804559606850219397283e-2}, Term{6, -1.7578125e-2}};

inline constexpr std::array kStage8 = {
    Term{1, 3.70920001185047927108779319836e-2}, Term{4, 1.70383925712239993810214054705e-1},
    Term{5, 1.07262030446373284651809199168e-1}, Term{6, -1.53194377486244017527936158236e-2},
    Term{7, 8.27378916381402288758473766002e-3}};

inline constexpr std::array kStage9 = {
    Term{1, 6.24110958716075717114429577812e-1},  Term{4, -3.36089262944694129406857109825},
    Term{5, -8.68219346841726006818189891453e-1}, Term{6, 2.75920996994467083049415600797e1},
    Term{7, 2.01540675504778934086186788979e1},   Term{8, -4.34898841810699588477366255144e1}};

inline constexpr std::array kStage10 = {
    Term{1, 4.77662536438264365890433908527e-1},  Term{4, -2.48811461997166764192642586468},
    Term{5, -5.90290826836842996371446475743e-1}, Term{6, 2.12300514481811942347288949897e1},
    Term{7, 1.52792336328824235832596922938e1},   Term{8, -3.32882109689848629194453265587e1},
    Term{9, -2.03312017085086261358222928593e-2}};

inline constexpr std::array kStage11 = {
    Term{1, -9.3714243008598732571704021658e-1}, Term{4, 5.18637242884406370830023853209},
    Term{5, 1.09143734899672957818500254654},    Term{6, -8.14978701074692612513997267357},
    Term{7, -1.85200656599969598641566180701e1}, Term{8, 2.27394870993505042818970056734e1},
    Term{9, 2.49360555267965238987089396762},    Term{10, -3.0467644718982195003823669022}};

inline constexpr std::array kStage12 = {
    Term{1, 2.27331014751653820792359768449},    Term{4, -1.05344954667372501984066689879e1},
    Term{5, -2.00087205822486249909675718444},   Term{6, -1.79589318631187989172765950534e1},
    Term{7, 2.79488845294199600508499808837e1},  Term{8, -2.85899827713502369474065508674},
    Term{9, -8.87285693353062954433549289258},   Term{10, 1.23605671757943030647266201528e1},
    Term{11, 6.43392746015763530355970484046e-1}};

// b_i: the solution of order 8 is y + h Σ b_i k_i.
inline constexpr std::array kSolution = {
    Term{1, 5.42937341165687622380535766363e-2},  Term{6, 4.45031289275240888144113950566},
    Term{7, 1.89151789931450038304281599044},     Term{8, -5.8012039600105847814672114227},
    Term{9, 3.1116436695781989440891606237e-1},   Term{10, -1.52160949662516078556178806805e-1},
    Term{11, 2.01365400804030348374776537501e-1}, Term{12, 4.47106157277725905176885569043e-2}};

// The estimator of order 5: its error is h Σ e_i k_i.
inline constexpr std::array kError5 = {
    Term{1, 1.312004499419488073250102996e-2},  Term{6, -1.225156446376204440720569753},
    Term{7, -4.957589496572501915214079952e-1}, Term{8, 1.664377182454986536961530415},
    Term{9, -3.503288487499736816886487290e-1}, Term{10, 3.341791187130174790297318841e-1},
    Term{11, 8.192320648511571246570742613e-2}, Term{12, -2.235530786388629525884427845e-2}};

// Weights of the embedded formula of order 3: the second estimator is h (Σ b_i k_i − Σ b̂_i k_i).
inline constexpr std::array kThirdOrder = {Term{1, 2.44094488188976377952755905512e-1},
                                           Term{9, 7.33846688281611857341361741547e-1},
                                           Term{12, 2.20588235294117647058823529412e-2}};

// The three additional stages of dense output.
inline constexpr std::array kStage14 = {
    Term{1, 5.61675022830479523392909219681e-2},  Term{7, 2.53500210216624811088794765333e-1},
    Term{8, -2.46239037470802489917441475441e-1}, Term{9, -1.24191423263816360469010140626e-1},
    Term{10, 1.5329179827876569731206322685e-1},  Term{11, 8.20105229563468988491666602057e-3},
    Term{12, 7.56789766054569976138603589584e-3}, Term{13, -8.298e-3}};

inline constexpr std::array kStage15 = {
    Term{1, 3.18346481635021405060768473261e-2},   Term{6, 2.83009096723667755288322961402e-2},
    Term{7, 5.35419883074385676223797384372e-2},   Term{8, -5.49237485713909884646569340306e-2},
    Term{11, -1.08347328697249322858509316994e-4}, Term{12, 3.82571090835658412954920192323e-4},
    Term{13, -3.40465008687404560802977114492e-4}, Term{14, 1.41312443674632500278074618366e-1}};

inline constexpr std::array kStage16 = {
    Term{1, -4.28896301583791923408573538692e-1}, Term{6, -4.69762141536116384314449447206},
    Term{7, 7.68342119606259904184240953878},     Term{8, 4.06898981839711007970213554331},
    Term{9, 3.56727187455281109270669543021e-1},  Term{13, -1.39902416515901462129418009734e-3},
    Term{14, 2.9475147891527723389556272149},     Term{15, -9.15095847217987001081870187138}};

// d_ji: coefficients 4 to 7 of the interpolating polynomial are h Σ_i d_ji k_i, as in dop853.
inline constexpr std::array kDense4 = {
    Term{1, -8.4289382761090128651353491142},     Term{6, 5.6671495351937776962531783590e-1},
    Term{7, -3.0689499459498916912797304727},     Term{8, 2.3846676565120698287728149680},
    Term{9, 2.1170345824450282767155149946},      Term{10, -8.7139158377797299206789907490e-1},
    Term{11, 2.2404374302607882758541771650},     Term{12, 6.3157877876946881815570249290e-1},
    Term{13, -8.8990336451333310820698117400e-2}, Term{14, 1.8148505520854727256656404962e1},
    Term{15, -9.1946323924783554000451984436},    Term{16, -4.4360363875948939664310572000}};

inline constexpr std::array kDense5 = {
    Term{1, 1.0427508642579134603413151009e1},   Term{6, 2.4228349177525818288430175319e2},
    Term{7, 1.6520045171727028198505394887e2},   Term{8, -3.7454675472269020279518312152e2},
    Term{9, -2.2113666853125306036270938578e1},  Term{10, 7.7334326684722638389603898808},
    Term{11, -3.0674084731089398182061213626e1}, Term{12, -9.3321305264302278729567221706},
    Term{13, 1.5697238121770843886131091075e1},  Term{14, -3.1139403219565177677282850411e1},
    Term{15, -9.3529243588444783865713862664},   Term{16, 3.5816841486394083752465898540e1}};

inline constexpr std::array kDense6 = {
    Term{1, 1.9985053242002433820987653617e1},  Term{6, -3.8703730874935176555105901742e2},
    Term{7, -1.8917813819516756882830838328e2}, Term{8, 5.2780815920542364900561016686e2},
    Term{9, -1.1573902539959630126141871134e1}, Term{10, 6.8812326946963000169666922661},
    Term{11, -1.0006050966910838403183860980},  Term{12, 7.7771377980534432092869265740e-1},
    Term{13, -2.7782057523535084065932004339},  Term{14, -6.0196695231264120758267380846e1},
    Term{15, 8.4320405506677161018159903784e1}, Term{16, 1.1992291136182789328035130030e1}};

inline constexpr std::array kDense7 = {
    Term{1, -2.5693933462703749003312586129e1},  Term{6, -1.5418974869023643374053993627e2},
    Term{7, -2.3152937917604549567536039109e2},  Term{8, 3.5763911791061412378285349910e2},
    Term{9, 9.3405324183624310003907691704e1},   Term{10, -3.7458323136451633156875139351e1},
    Term{11, 1.0409964950896230045147246184e2},  Term{12, 2.9840293426660503123344363579e1},
    Term{13, -4.3533456590011143754432175058e1}, Term{14, 9.6324553959188282948394950600e1},
    Term{15, -3.9177261675615439165231486172e1}, Term{16, -1.4972683625798562581422125276e2}};

// --- The arithmetic of a step. The derivative at stage j of a state of n numbers is at stages + (j - 1) n. -----------

/// Number i of sum_j weight_j k_j, over a row of the tableau.
template <const auto& kRow, class S>
GRAPNEL_INLINE S weighted_sum(const S* stages, int n, int i) {
  const S* k = stages + i;
  return [&]<std::size_t... J>(std::index_sequence<J...>) __attribute__((always_inline)) {
    return S(((S(kRow[J].weight) * k[(kRow[J].stage - 1) * n]) + ...));
  }
  (std::make_index_sequence<kRow.size()>{});
}

/// A step of size h from a state of n numbers at t, and storage for the state at a stage and the derivatives at all.
template <class S>
struct StepStages {
  S t, h;
  int n;
  const S* from;
  S* state;
  S* derivatives;
};

/// k_number = f(t + c h, from + h sum a k). f is called as f(t, y, dydt).
template <int kNumber, const auto& kRow, class S, class F>
void evaluate_stage(F&& f, const StepStages<S>& step) {
  const auto [t, h, n, from, state, stages] = step;
  for (int i = 0; i < n; ++i) state[i] = from[i] + h * weighted_sum<kRow>(stages, n, i);
  f(S(t + S(kNodes[kNumber - 1]) * h), state, stages + (kNumber - 1) * n);
}

/// Stages 2 to 12, the state of order 8 in `end`, and the two error estimates per unit of step; stage 1 must be set.
template <class S, class F>
void evaluate_stages(F&& f, const StepStages<S>& step, S* end, S* error5, S* error3) {
  evaluate_stage<2, kStage2>(f, step);
  evaluate_stage<3, kStage3>(f, step);
  evaluate_stage<4, kStage4>(f, step);
  evaluate_stage<5, kStage5>(f, step);
  evaluate_stage<6, kStage6>(f, step);
  evaluate_stage<7, kStage7>(f, step);
  evaluate_stage<8, kStage8>(f, step);
  evaluate_stage<9, kStage9>(f, step);
  evaluate_stage<10, kStage10>(f, step);
  evaluate_stage<11, kStage11>(f, step);
  evaluate_stage<12, kStage12>(f, step);
  const auto [t, h, n, from, state, stages] = step;
  for (int i = 0; i < n; ++i) {
    const S slope = weighted_sum<kSolution>(stages, n, i);
    end[i] = from[i] + h * slope;
    error3[i] = slope - weighted_sum<kThirdOrder>(stages, n, i);
    error5[i] = weighted_sum<kError5>(stages, n, i);
  }
}

/// Combined error estimate of order h^8: err = h e5^2 / sqrt(e5^2 + 0.01 e3^2), in the root-mean-square norm (HNW
/// II.10), from sums of squares over `dimension` numbers. At most 1: acceptable. NaN if a sum overflows, as after a
/// step that diverges.
template <class S>
GRAPNEL_INLINE S combined_error(const S& h, const S& sum5, const S& sum3, int dimension) {
  using std::sqrt;
  // The smallest normal number prevents 0/0.
  const S denominator = S(dimension) * S(sum5 + S(0.01) * sum3) + S(0x1p-1022);
  return S(h * sum5) / sqrt(denominator) + S(S(0.0) * denominator);  // not 0 for an infinite denominator
}

// --- Size of the next step (HNW II.4), in doubles: every lane has its own step. The caller computes roots: std::pow
// here, exactly rounded operations in lanes, so that every instruction set gives the same bits.
// ------------------------

inline constexpr double kSafety = 0.9;
inline constexpr double kSmallestFactor = 1.0 / 3.0;
inline constexpr double kLargestFactor = 6.0;
inline constexpr double kNonFiniteFactor = 0.1;  // after a step whose result is not finite
/// Largest |‖q‖ − 1| at the end of a step. In accepted steps it is of the size of the tolerance.
inline constexpr double kLargestDefect = 0.1;
inline constexpr double kStretch = 1.01;  // the last step may be longer by this factor, to avoid a tiny final step

GRAPNEL_INLINE double smaller(double a, double b) { return b < a ? b : a; }
GRAPNEL_INLINE double larger(double a, double b) { return a < b ? b : a; }

/// A step fitted to the remaining interval; sizes are positive.
struct FittedStep {
  double wanted;   // before it was fitted
  bool last;       // it reaches the end time
  bool too_small;  // below the resolution of time
};
GRAPNEL_INLINE FittedStep fit_step(double proposed, double longest, double remaining, double time) {
  FittedStep step;
  step.wanted = smaller(proposed, longest);
  step.last = remaining <= smaller(kStretch * step.wanted, (1.0 + 1e-10) * longest);
  step.too_small = !step.last && step.wanted <= 10.0 * 0x1p-52 * __builtin_fabs(time);
  return step;
}

/// The last accepted step: its size, 0 for none, and error^(-1/8).
struct AcceptedStep {
  double size = 0, inverse_root = 1;
};
/// Gustafsson's predictive control [Hairer and Wanner 1996, IV.8]: the error^(-1/8) for the next step size if the error
/// continues to change as from `before` to this step; at most this step's own value.
GRAPNEL_INLINE double predicted_root(double step, double inverse_root, const AcceptedStep& before) {
  constexpr double kLargestRoot = 1.7782794100389228;  // for an error of 0.01; smaller errors carry no information
  if (!(before.size > 0)) return inverse_root;
  const double root_before = smaller(before.inverse_root, kLargestRoot);
  return smaller(inverse_root, inverse_root * inverse_root / root_before * (step / before.size));
}

/// The step size after a step of size `step` with error^(-1/8), accepted or rejected.
GRAPNEL_INLINE double size_after_accepted(double step, double inverse_root, bool rejected_before) {
  return step * larger(smaller(kSafety * inverse_root, rejected_before ? 1.0 : kLargestFactor), kSmallestFactor);
}
GRAPNEL_INLINE double size_after_rejected(double step, double inverse_root, bool finite) {
  return step * (finite ? larger(kSafety * inverse_root, kSmallestFactor) : kNonFiniteFactor);
}

/// Size of an Euler step with a small increment, for the norms of state and rate.
GRAPNEL_INLINE double first_euler_step(double size_y, double size_f, double longest) {
  return smaller(size_y < 1e-5 || size_f < 1e-5 ? 1e-6 : 0.01 * size_y / size_f, longest);
}
/// The first step, from the norm of the second derivative estimated by the Euler step. `root`: (0.01/x)^(1/8).
template <class Root>
GRAPNEL_INLINE double first_step(double euler, double size_f, double second, double longest, Root&& root) {
  if (!__builtin_isfinite(second)) return smaller(1e-6, longest);
  const double largest = larger(size_f, second);
  const double step = largest <= 1e-15 ? larger(1e-6, euler * 1e-3) : root(largest);
  return smaller(smaller(100.0 * euler, step), longest);
}

}  // namespace grapnel::dop853
