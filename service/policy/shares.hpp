// What each user takes of that which all users share: so that nobody can use it up.
//
// The rule is one for all: nobody may have more of anything than is left for the others. So the
// first may have half, the next a quarter, and however many come something is left. A robot on
// which one user runs nearly everything gives that user more: with a share of P percent, P : 100-P
// takes the place of 1 : 1. A sixteenth is kept for root and the daemon's own user, who else are
// bound by the same rule: a mistake of root's harms others too.
//
// What the daemon takes for itself, above all names of models, counts and is not refused.
//
// Thread safety: none. A Shares outlives its charges; each account comes back to zero.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace arbiter::service {

enum class Share : std::uint8_t {
  kClients,      // conversations with nodes
  kSources,      // names of output ports that no model names
  kInputs,       // the same of input ports
  kDescriptors,  // open files
  kQueue,        // bytes of messages that wait, to be read or to be served, and of claims
  kInFlight,     // descriptors that have been sent and not been received
};
inline constexpr std::size_t kShareCount = 6;

class LimitExceeded : public std::length_error {
 public:
  using std::length_error::length_error;
};

class Shares;

// Something taken; its end gives it back.
class Charge {
 public:
  Charge() = default;
  Charge(Charge&& other) noexcept { swap(other); }
  Charge& operator=(Charge&& other) noexcept {
    Charge taken(std::move(other));
    swap(taken);
    return *this;
  }
  Charge(const Charge&) = delete;
  Charge& operator=(const Charge&) = delete;
  ~Charge();

  explicit operator bool() const noexcept { return shares_ != nullptr; }
  // Whose it is; false also of what the daemon has taken for itself.
  [[nodiscard]] bool is_of(uid_t user) const noexcept { return shares_ && !own_ && user_ == user; }
  [[nodiscard]] bool is_own() const noexcept { return shares_ && own_; }

 private:
  friend class Shares;
  Charge(Shares& shares, Share what, std::uint64_t amount, uid_t user, bool own) noexcept
      : shares_(&shares), amount_(amount), user_(user), what_(what), own_(own) {}
  void swap(Charge& other) noexcept {
    std::swap(shares_, other.shares_);
    std::swap(amount_, other.amount_);
    std::swap(user_, other.user_);
    std::swap(what_, other.what_);
    std::swap(own_, other.own_);
  }

  Shares* shares_ = nullptr;
  std::uint64_t amount_ = 0;
  uid_t user_ = 0;
  Share what_ = Share::kClients;
  bool own_ = false;
};

using Totals = std::array<std::uint64_t, kShareCount>;

class Shares {
 public:
  static constexpr unsigned kDefaultPercent = 50;
  static constexpr std::uint64_t kReserve = 16;  // one of so many parts

  // `owner`: the daemon's own user. `percent`: from 1 to 99.
  Shares(const Totals& totals, unsigned percent, uid_t owner)
      : totals_(totals), percent_(percent), owner_(owner) {}
  Shares(const Shares&) = delete;
  Shares& operator=(const Shares&) = delete;
  ~Shares();

  // Throws LimitExceeded, naming the limit and what to do.
  Charge take(uid_t user, Share what, std::uint64_t amount = 1);
  // For the daemon itself.
  Charge take_own(Share what, std::uint64_t amount = 1);
  // What the daemon has taken for itself is the user's from now on, as far as it is within the
  // user's share, and `left` more are.
  void pass_to(uid_t user, Charge& charge, std::uint64_t left = 0);
  // What a user has taken is the daemon's own from now on.
  void make_own(Charge& charge);

  [[nodiscard]] bool allows(uid_t user, Share what, std::uint64_t amount) const;
  [[nodiscard]] std::uint64_t taken(uid_t user, Share what) const;
  [[nodiscard]] bool is_privileged(uid_t user) const { return user == 0 || user == owner_; }

 private:
  friend class Charge;
  struct Account {
    std::array<std::uint64_t, kShareCount> taken{};
  };
  void add(Account& account, Share what, std::uint64_t amount);
  void give_back(const Charge& charge) noexcept;
  [[nodiscard]] std::uint64_t taken_by_privileged(Share what) const;
  [[nodiscard]] std::string refusal(uid_t user, Share what) const;

  const Totals totals_;
  const unsigned percent_;
  const uid_t owner_;
  Account all_;
  Account own_;
  std::map<uid_t, Account> accounts_;  // of users who have something
};

// By the process's limit of descriptors, less what messages may bring
// (service/policy/headroom.hpp).
Totals totals_of_this_process();

}  // namespace arbiter::service
