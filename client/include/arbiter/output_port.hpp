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
  // Memory for `size` bytes; empty if max_loans are out or size is above max_size. Wait-free.
  [[nodiscard]] std::optional<Loan<void>> loan(std::size_t size) noexcept {
    const detail::LoanedSlot slot = detail::loan(*core_, size);
    if (slot.data == nullptr) return std::nullopt;
    return Loan<void>(*core_, slot, size);
  }
  Outcome publish(Loan<void> loan) {
    if (loan.core_ == nullptr || loan.core_.get() != core_.get()) {
      throw std::invalid_argument("the loan is not one of this port");
    }
    static_cast<void>(loan.core_.release());
    return detail::publish(*core_, loan.core_.get_deleter().slot, loan.size());
  }
  // With a copy. Throws std::invalid_argument for more than max_size bytes.
  Outcome publish(Bytes bytes) {
    if (bytes.size() > max_size()) throw std::invalid_argument("the sample is above max_size");
    return detail::publish_copy(*core_, bytes.data(), bytes.size());
  }
  [[nodiscard]] std::size_t max_size() const noexcept { return detail::max_size(*core_); }

 private:
  friend class Node;
  using OutputPortBase::OutputPortBase;
};

}  // namespace arbiter
