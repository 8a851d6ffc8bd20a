#include "grapnel/scenario/problem_bytes.hpp"

#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

namespace grapnel {

// ---- The members of plain structures: the compiler knows them, and none is forgotten ----

namespace member_counting {
// Converts to whatever a member is; nobody calls it.
struct Anything {
  template <class T>
  operator T&() const noexcept;
};
}  // namespace member_counting

namespace {

using member_counting::Anything;

// How many members an aggregate has: as many as can be initialized. A base class counts as one.
template <class T, class... Some>
consteval std::size_t member_count() {
  if constexpr (requires { T{Some{}..., Anything{}}; })
    return member_count<T, Some..., Anything>();
  else
    return sizeof...(Some);
}

// Calls visit(member, member, ...).
// clang-format off
template <class T, class Visit>
void with_members(const T& value, Visit visit) {
  constexpr std::size_t kCount = member_count<T>();
  if constexpr (kCount == 1) {
    const auto& [a] = value;
    visit(a);
  } else if constexpr (kCount == 2) {
    const auto& [a, b] = value;
    visit(a, b);
  } else if constexpr (kCount == 3) {
    const auto& [a, b, c] = value;
    visit(a, b, c);
  } else if constexpr (kCount == 4) {
    const auto& [a, b, c, d] = value;
    visit(a, b, c, d);
  } else if constexpr (kCount == 5) {
    const auto& [a, b, c, d, e] = value;
    visit(a, b, c, d, e);
  } else if constexpr (kCount == 6) {
    const auto& [a, b, c, d, e, f] = value;
    visit(a, b, c, d, e, f);
  } else if constexpr (kCount == 7) {
    const auto& [a, b, c, d, e, f, g] = value;
    visit(a, b, c, d, e, f, g);
  } else if constexpr (kCount == 8) {
    const auto& [a, b, c, d, e, f, g, h] = value;
    visit(a, b, c, d, e, f, g, h);
  } else if constexpr (kCount == 9) {
    const auto& [a, b, c, d, e, f, g, h, i] = value;
    visit(a, b, c, d, e, f, g, h, i);
  } else if constexpr (kCount == 10) {
    const auto& [a, b, c, d, e, f, g, h, i, j] = value;
    visit(a, b, c, d, e, f, g, h, i, j);
  } else if constexpr (kCount == 11) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k);
  } else if constexpr (kCount == 12) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l);
  } else if constexpr (kCount == 13) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m);
  } else if constexpr (kCount == 14) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n);
  } else if constexpr (kCount == 15) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o);
  } else if constexpr (kCount == 16) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p);
  } else if constexpr (kCount == 17) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q);
  } else if constexpr (kCount == 18) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r);
  } else if constexpr (kCount == 19) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s);
  } else if constexpr (kCount == 20) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t);
  } else if constexpr (kCount == 21) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u);
  } else if constexpr (kCount == 22) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v);
  } else if constexpr (kCount == 23) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w);
  } else if constexpr (kCount == 24) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x] = value;
    visit(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x);
  } else {
    static_assert(kCount == 0, "too many members for this list");
  }
}
// clang-format on

// ---- Bytes ----

class Bytes {
 public:
  std::string text;

  template <class Number>
  requires std::is_arithmetic_v<Number> || std::is_enum_v<Number>
  void put(const Number& number) {
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    text.append(bytes, sizeof number);
  }
  void put(const std::string& words) {
    put(words.size());
    text += words;
  }
  template <class Value>
  void put(const std::optional<Value>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class Value>
  void put(const std::vector<Value>& list) {
    put(list.size());
    for (const Value& one : list) put(one);
  }
  template <class A, class B>
  void put(const std::pair<A, B>& both) {
    put(both.first);
    put(both.second);
  }
  void put(const std::shared_ptr<const TriangleMesh>& mesh) { put(reinterpret_cast<std::uintptr_t>(mesh.get())); }
  void put(const std::shared_ptr<const SourceTexts>&) {}  // says where a problem came from, not what it is
  void put(const Vector3d& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  void put(const Rotationd& R) {
    for (int i = 0; i < 3; ++i) put(R.column(i));
  }
  void put(const EndEffectorSetup& e) {
    static_assert(member_count<EndEffectorSetup>() == 4, "a member is missing below");
    put(static_cast<const FrameDescription&>(e));
    put(e.approach_axis), put(e.envelope), put(e.rating);
  }
  template <class Structure>
  requires std::is_aggregate_v<Structure>
  void put(const Structure& structure) {
    with_members(structure, [this](const auto&... members) { (this->put(members), ...); });
  }
};

}  // namespace

std::string problem_bytes(const CaptureProblem& problem) {
  CaptureProblem nameless = problem;
  nameless.sha256.clear();
  Bytes bytes;
  bytes.put(nameless);
  return std::move(bytes.text);
}

}  // namespace grapnel
