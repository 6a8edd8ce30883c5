// Output ports: where a component's data leaves it (paper, section III).
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include <arbiter/bytes.hpp>
#include <arbiter/detail/cores.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>

namespace arbiter {

template <class T = void>
class OutputPort;

// A sample being written, in the memory in which receivers will read it. It belongs to the port
// that lent it; given up without being published, it is free again. May outlive its port.
template <class T>
class Loan {
 public:
  T& operator*() const noexcept { return *get(); }
  T* operator->() const noexcept { return get(); }
  [[nodiscard]] T* get() const noexcept { return std::launder(reinterpret_cast<T*>(data_)); }

 private:
  friend class OutputPort<T>;
  Loan(detail::OutputCore& core, detail::LoanedSlot slot) noexcept
      : core_(&core, {slot.slot}), data_(slot.data) {}

  detail::LoanedBy core_;  // null once published
  std::byte* data_;
};

// The same for an untyped port: bytes.
template <>
class Loan<void> {
 public:
  const WritableBytes& operator*() const noexcept { return bytes_; }
  const WritableBytes* operator->() const noexcept { return &bytes_; }
  [[nodiscard]] std::byte* data() const noexcept { return bytes_.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  // Publish only the first `size` bytes.
  void shrink(std::size_t size) noexcept {
    if (size < bytes_.size()) bytes_ = {bytes_.data(), size};
  }

 private:
  friend class OutputPort<void>;
  Loan(detail::OutputCore& core, detail::LoanedSlot slot, std::size_t size) noexcept
      : core_(&core, {slot.slot}), bytes_(slot.data, size) {}

  detail::LoanedBy core_;  // null once published
  WritableBytes bytes_;
};

// What typed and untyped output ports have in common. Movable; closing it (by its destructor)
// leaves its source active until its T has passed, and leaves what it has delivered to be taken.
class OutputPortBase {
 public:
  OutputPortBase(OutputPortBase&&) noexcept = default;
  OutputPortBase& operator=(OutputPortBase&& other) noexcept {
    if (this != &other) {
      detail::close_output(std::move(core_));
      core_ = std::move(other.core_);
    }
    return *this;
  }
  ~OutputPortBase() { detail::close_output(std::move(core_)); }

  // Activity without a sample: the source becomes, or stays, active. `discarded` counts the
  // connected input ports at which it is not the winner; nothing is delivered. Wait-free.
  Outcome signal() noexcept { return detail::signal(*core_); }
  // Ends the source's activity at once. Wait-free.
  void deactivate() noexcept { detail::deactivate(*core_); }
  // The port's name, which is also its source's.
  [[nodiscard]] const std::string& name() const noexcept { return detail::name(*core_); }
  [[nodiscard]] const Type& type() const noexcept { return detail::type(*core_); }

 protected:
  explicit OutputPortBase(std::shared_ptr<detail::OutputCore> core) noexcept
      : core_(std::move(core)) {}

  std::shared_ptr<detail::OutputCore> core_;
};

template <class T>
class OutputPort : public OutputPortBase {
 public:
  // Memory for a sample; empty if max_loans are out. Not zeroed. Wait-free.
  [[nodiscard]] std::optional<Loan<T>> loan() noexcept {
    const detail::LoanedSlot slot = detail::loan(*core_, sizeof(T));
    if (slot.data == nullptr) return std::nullopt;
    if constexpr (std::is_default_constructible_v<T>) ::new (static_cast<void*>(slot.data)) T;
    return Loan<T>(*core_, slot);
  }
  // The arrival of a sample at all connected input ports: makes the source active, decides at each
  // port, and hands the sample to those where it wins. A loser wakes nobody. Wait-free; 50 ns and
  // up. Throws std::invalid_argument for a loan that is empty or another port's.
  Outcome publish(Loan<T> loan) {
    if (loan.core_ == nullptr || loan.core_.get() != core_.get()) {
      throw std::invalid_argument("the loan is not one of this port");
    }
    static_cast<void>(loan.core_.release());
    return detail::publish(*core_, loan.core_.get_deleter().slot, sizeof(T));
  }
  // The same with a copy of `sample`.
  Outcome publish(const T& sample) noexcept {
    return detail::publish_copy(*core_, &sample, sizeof(T));
  }

 private:
  friend class Node;
  using OutputPortBase::OutputPortBase;
};

template <>
class OutputPort<void> : public OutputPortBase {
 public:
  // Memory for `size` bytes; empty if max_loans are out, or `size` is not what a sample may have:
  // that of its type, or for an untyped port, up to max_size. Wait-free.
  [[nodiscard]] std::optional<Loan<void>> loan(std::size_t size) noexcept {
    if (!may_have(size)) return std::nullopt;
    const detail::LoanedSlot slot = detail::loan(*core_, size);
    if (slot.data == nullptr) return std::nullopt;
    return Loan<void>(*core_, slot, size);
  }
  // As for a typed port. Throws std::invalid_argument, too, for a loan that was shrunk where a type
  // says how large samples are.
  Outcome publish(Loan<void> loan) {
    if (loan.core_ == nullptr || loan.core_.get() != core_.get()) {
      throw std::invalid_argument("the loan is not one of this port");
    }
    require_size(loan.size());
    static_cast<void>(loan.core_.release());
    return detail::publish(*core_, loan.core_.get_deleter().slot, loan.size());
  }
  // With a copy. Throws std::invalid_argument for a size that loan() would not give.
  Outcome publish(Bytes bytes) {
    require_size(bytes.size());
    return detail::publish_copy(*core_, bytes.data(), bytes.size());
  }
  // The largest sample, in bytes; where the port has a type, that of each.
  [[nodiscard]] std::size_t max_size() const noexcept { return detail::max_size(*core_); }

 private:
  friend class Node;
  using OutputPortBase::OutputPortBase;

  [[nodiscard]] bool may_have(std::size_t size) const noexcept {
    return size == max_size() || (size < max_size() && type().is_untyped());
  }
  void require_size(std::size_t size) const {
    if (may_have(size)) return;
    throw std::invalid_argument(name() + ": a sample of " + std::to_string(size) +
                                " bytes, but its type or max_size says " +
                                std::to_string(max_size()));
  }
};

}  // namespace arbiter
