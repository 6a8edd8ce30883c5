// The type of what a port carries: a name, a size and an alignment.
//
//   struct Twist { double linear[3], angular[3]; };
//   ARBITER_TYPE(Twist, "geometry/Twist");               // beside its definition, in no namespace
//
//   auto out = node.output_port<Twist>("/Joystick/cmd:o");
//   auto in = node.input_port("/Base/cmd:i", arbiter::Type("geometry/Twist", 48, 8));  // elsewhere
//
// Two types are equal if and only if their names are equal, byte for byte, and their sizes and
// alignments are, too. Nothing else is compared: two programs that give one name to two layouts of
// the same size misunderstand each other. Put a version into the name when the layout changes.
//
// A type may also have samples of any size, such as serialised messages: Type::variable(). Two such
// types are equal if their names are; none of them is equal to a type of one size.
//
// Samples go from an output port to an input port if the two ports' types are equal, or the input
// port is untyped. Otherwise the two are not connected; a notice to both (NoticeKind::refused), the
// daemon's log, `arbiter status` and `arbiter why` name both types and both components.
//
// A type's name is 1 to 239 bytes of UTF-8, without control or invisible characters. A C++ type
// without a name of its own has the name that the compiler writes, with its namespaces
// ("robot::Twist", demangled as GCC and Clang do it; beyond 239 bytes, a hash of the whole replaces
// its end). Programs that are built alike may rely on that. Name the types that others feed or
// read: a script, a gateway, another language, another standard library. Without RTTI (-fno-rtti)
// each needs a name.
//
// Threads: a Type is a value. Blocking: none. Cost: a copy may allocate; nothing here is on the
// data path.
#pragma once

#ifndef __cpp_exceptions
#error "arbiter reports errors by exceptions: compile without -fno-exceptions"
#endif
// It changes the layout of containers, which program and library hand each other.
#if defined(_GLIBCXX_DEBUG) && !defined(ARBITER_HAS_GLIBCXX_DEBUG)
#error "arbiter's library has no _GLIBCXX_DEBUG: build both with it and ARBITER_HAS_GLIBCXX_DEBUG"
#endif

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>

namespace arbiter {

class Type {
 public:
  // `size` of a sample and `alignment` are in bytes: 1 to 2^40, and a power of two up to 4096, or 0
  // (variable()).
  // Throws arbiter::Error if one of the three is out of bounds.
  Type(std::string_view name, std::size_t size, std::size_t alignment);
  // Samples of any size up to `max_size`: plain bytes, whose meaning the programs agree upon.
  [[nodiscard]] static Type untyped(std::size_t max_size) noexcept;
  // The same with a name: "geometry_msgs/msg/Twist", serialised. `max_size` is the largest that an
  // output port sends, at least 1; an input port takes larger ones, too. An alignment of 0 says it,
  // here and in the constructor above. Throws arbiter::Error as that.
  [[nodiscard]] static Type variable(std::string_view name, std::size_t max_size) {
    return {name, max_size, 0};
  }

  // Empty: untyped.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Bytes of a sample. Untyped or variable: the most that a sample may have; 0 at an untyped input
  // port, which takes any.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  // In bytes. Untyped: the alignment of a sample in memory; 1 at an input port. Variable: 0, though
  // in memory each sample is aligned to 64.
  [[nodiscard]] std::size_t alignment() const noexcept { return alignment_; }
  [[nodiscard]] bool is_untyped() const noexcept { return name_.empty(); }
  // It has a name, and samples of any size.
  [[nodiscard]] bool is_variable() const noexcept { return alignment_ == 0; }
  // All samples have size() bytes.
  [[nodiscard]] bool has_one_size() const noexcept { return !is_untyped() && !is_variable(); }

  // By the rule above.
  friend bool operator==(const Type& one, const Type& other) noexcept {
    return one.name_ == other.name_ && one.alignment_ == other.alignment_ &&
           (one.size_ == other.size_ || one.is_variable());
  }
  friend bool operator!=(const Type& one, const Type& other) noexcept { return !(one == other); }

 private:
  // Not a default constructor: {} for the options of a port would be ambiguous.
  struct Untyped {
    explicit Untyped(std::size_t size) noexcept : max_size(size) {}
    std::size_t max_size;
  };
  explicit Type(Untyped untyped) noexcept;

  std::string name_;
  std::size_t size_;
  std::size_t alignment_;
};

// The name of T, if it has been given one. Specialise it as ARBITER_TYPE does, or partially:
//
//   template <class Scalar>
//   struct arbiter::TypeName<Grid<Scalar>> {
//     static constexpr std::string_view value = "maps/Grid." + …;
//   };
template <class T>
struct TypeName {
  static constexpr std::string_view value{};  // none. NOLINT(readability-identifier-naming)
};

namespace detail {

Type type_of_cpp(const char* mangled_name, std::size_t size, std::size_t alignment);

// Checks as much as can be checked while compiling; Type() checks the rest.
constexpr bool may_be_type_name(std::string_view name) noexcept {
  for (const char byte : name) {
    if ((static_cast<unsigned char>(byte) < 0x20) || byte == 0x7f) return false;
  }
  return !name.empty() && name.size() <= 239;
}

}  // namespace detail

// T as its ports declare it; const T is the same. Throws arbiter::Error if its given name is not a
// proper one.
template <class T>
[[nodiscard]] Type type_of() {
  using Plain = std::remove_cv_t<T>;
  static_assert(
      std::is_trivially_copyable_v<T>,
      "a sample is read in place by other processes: its type must be trivially copyable");
  static_assert(!std::is_pointer_v<T>, "a pointer means nothing in another process");
  static_assert(alignof(T) <= 4096, "samples are aligned to at most a page");
  if constexpr (TypeName<Plain>::value.empty()) {
#ifdef __cpp_rtti
    return detail::type_of_cpp(typeid(Plain).name(), sizeof(T), alignof(T));
#else
    static_assert(!TypeName<Plain>::value.empty(),
                  "without RTTI (-fno-rtti) a type has no name of the compiler's: give it one with "
                  "ARBITER_TYPE");
#endif
  } else {
    return Type(TypeName<Plain>::value, sizeof(T), alignof(T));
  }
}

}  // namespace arbiter

// Names a C++ type. In no namespace, after the type is defined and before a port of it is opened,
// in each program that opens one: best in the header that defines it. A type with a comma in it
// needs an alias.
#define ARBITER_TYPE(CppType, type_name)                                          \
  template <>                                                                     \
  struct arbiter::TypeName<CppType> {                                             \
    static constexpr ::std::string_view value = type_name;                        \
    static_assert(::arbiter::detail::may_be_type_name(value),                     \
                  "a type's name has 1 to 239 bytes, and no control characters"); \
  }
