#pragma once

/// @file
/// Results of Pack, one function per instruction set with plain arrays, so that the sets can be compared in one
/// program.

namespace grapnel::lanes::testing {

/// Results of one triple of numbers a, b, c, in this order.
enum PackResult : int {
  kSum,
  kDifference,
  kProduct,
  kQuotient,
  kNegative,
  kRoot,
  kMagnitude,
  kSmaller,
  kLarger,
  kProductPlus,      // a b + c
  kPlusProduct,      // c + a b
  kProductMinus,     // a b - c
  kMinusProduct,     // c - a b
  kTwoProducts,      // a b + b c
  kProductsApart,    // a b - b c
  kNegativeProduct,  // -(a b) + c
  kThreeProducts,    // a b + b c - c a
  kAddedProduct,     // c += a b
  kTakenProduct,     // c -= a b
  kMixed,            // 2 (a - 0.5 b) / 3
  kSelected,         // a where a b < c, else b
  kEqual,            // 1 where a == b, likewise
  kUnequal,
  kLess,
  kLessOrEqual,
  kGreater,
  kGreaterOrEqual,
  kBoth,  // (a < b) & (b < c), with |, and !
  kEither,
  kNeither,
  kPackResults
};

struct PackChecks {
  int width;
  /// `count` triples, a multiple of width; result k of triple i goes to out[k * count + i].
  void (*arithmetic)(const double* a, const double* b, const double* c, double* out, int count);
  /// Conversion of masks to bits and back, reading and writing of lanes: the number of the first error, 0 for none.
  int (*masks)();
  /// Of `count` pairs, a multiple of width.
  void (*turns)(const double* s, const double* w, double* out, int count);
};

/// The checks of an instruction set, defined in pack_checks_set.cpp.
template <class Set>
const PackChecks& pack_checks_of();

}  // namespace grapnel::lanes::testing
