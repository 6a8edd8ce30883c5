#include "service/policy/shares.hpp"

#include <algorithm>
#include <limits>

#include "service/policy/headroom.hpp"
#include "service/policy/users.hpp"
#include "shm/assertion.hpp"
#include "shm/limits.hpp"

namespace arbiter::service {
namespace {

// Messages that wait for all clients together.
constexpr std::uint64_t kMaxQueuedBytes = 64u << 20;
// What the loop itself, the log, and the files of models need.
constexpr std::uint64_t kOwnDescriptors = 64;

struct Naming {
  const char* what;
  const char* limit;
  const char* to_do;
};

Naming naming(Share what) {
  switch (what) {
    case Share::kClients:
      return {"clients", "kMaxClients", "end some of its nodes"};
    case Share::kSources:
      return {"names of output ports that no model names", "kMaxSources",
              "close some, or name them in the model"};
    case Share::kInputs:
      return {"names of input ports that no model names", "kMaxInputPorts",
              "close some, or name them in the model"};
    case Share::kDescriptors:
      return {"descriptors", "the daemon's RLIMIT_NOFILE, less what it needs itself",
              "close ports or nodes, or raise LimitNOFILE= of the service"};
    case Share::kQueue:
      return {"bytes of waiting messages", "64 MiB", "let its nodes read what they are sent"};
    case Share::kInFlight:
      return {"descriptors under way", "a quarter of the daemon's RLIMIT_NOFILE",
              "let its nodes read what they are sent"};
  }
  return {"", "", ""};
}

std::size_t index(Share what) { return static_cast<std::size_t>(what); }

}  // namespace

Totals totals_of_this_process() {
  const std::uint64_t descriptors = std::min<std::uint64_t>(
      Headroom::of_the_process().limit(), std::numeric_limits<std::int32_t>::max());
  Totals totals{};
  totals[index(Share::kClients)] = shm::kMaxClients;
  totals[index(Share::kSources)] = shm::kMaxSources;
  totals[index(Share::kInputs)] = shm::kMaxInputPorts;
  totals[index(Share::kDescriptors)] = descriptors - std::min(kOwnDescriptors, descriptors / 2);
  totals[index(Share::kQueue)] = kMaxQueuedBytes;
  // The rest is for what each client may have beside it (InFlight), and for components of the
  // daemon's own user, whose messages the kernel counts too.
  totals[index(Share::kInFlight)] = descriptors / 4;
  return totals;
}

Charge::~Charge() {
  if (shares_ != nullptr) shares_->give_back(*this);
}

Shares::~Shares() {
  ARBITER_ASSERT(accounts_.empty(), "a user's share is still taken when the daemon ends");
  for (const std::uint64_t left : all_.taken) {
    ARBITER_ASSERT(left == 0, "a share is still taken when the daemon ends");
  }
}

void Shares::add(Account& account, Share what, std::uint64_t amount) {
  account.taken[index(what)] += amount;
  all_.taken[index(what)] += amount;
}

Charge Shares::take(uid_t user, Share what, std::uint64_t amount) {
  // Or its account might be closed before it is given back.
  if (amount == 0) return {};
  if (!allows(user, what, amount)) throw LimitExceeded(refusal(user, what));
  add(accounts_[user], what, amount);
  return {*this, what, amount, user, false};
}

Charge Shares::take_own(Share what, std::uint64_t amount) {
  add(own_, what, amount);
  return {*this, what, amount, 0, true};
}

void Shares::pass_to(uid_t user, Charge& charge, std::uint64_t left) {
  if (!charge.is_own()) return;
  const Share what = charge.what_;
  const std::uint64_t amount = charge.amount_;
  charge = {};
  charge = allows(user, what, amount + left) ? take(user, what, amount) : take_own(what, amount);
}

void Shares::make_own(Charge& charge) {
  if (!charge || charge.is_own()) return;
  const Share what = charge.what_;
  const std::uint64_t amount = charge.amount_;
  charge = {};
  charge = take_own(what, amount);
}

void Shares::give_back(const Charge& charge) noexcept {
  const std::size_t at = index(charge.what_);
  ARBITER_ASSERT(all_.taken[at] >= charge.amount_, "more of a share is given back than was taken");
  all_.taken[at] -= charge.amount_;
  if (charge.own_) {
    ARBITER_ASSERT(own_.taken[at] >= charge.amount_, "the daemon gives back more than it took");
    own_.taken[at] -= charge.amount_;
    return;
  }
  const auto account = accounts_.find(charge.user_);
  ARBITER_ASSERT(account != accounts_.end() && account->second.taken[at] >= charge.amount_,
                 "more of a user's share is given back than was taken");
  account->second.taken[at] -= charge.amount_;
  const auto& taken = account->second.taken;
  const bool is_empty =
      std::all_of(taken.begin(), taken.end(), [](std::uint64_t left) { return left == 0; });
  if (is_empty) accounts_.erase(account);
}

std::uint64_t Shares::taken(uid_t user, Share what) const {
  const auto account = accounts_.find(user);
  return account == accounts_.end() ? 0 : account->second.taken[index(what)];
}

std::uint64_t Shares::taken_by_privileged(Share what) const {
  return taken(0, what) + (owner_ == 0 ? 0 : taken(owner_, what));
}

bool Shares::allows(uid_t user, Share what, std::uint64_t amount) const {
  if (amount == 0) return true;  // though others have left less than the user has
  const std::uint64_t total = totals_[index(what)];
  const std::uint64_t reserve = total / kReserve;
  const std::uint64_t privileged = taken_by_privileged(what);
  const std::uint64_t kept = is_privileged(user) ? 0 : reserve - std::min(reserve, privileged);
  const std::uint64_t gone = all_.taken[index(what)] + kept + amount;
  if (gone > total) return false;
  if (is_privileged(user) && privileged + amount <= reserve) return true;
  return (taken(user, what) + amount) * (100 - percent_) <= (total - gone) * percent_;
}

std::string Shares::refusal(uid_t user, Share what) const {
  const Naming name = naming(what);
  return "limit-exceeded: user " + describe_user(user) + " has " +
         std::to_string(taken(user, what)) + " " + name.what + ", of " +
         std::to_string(totals_[index(what)]) + " (" + name.limit + ") for all users, " +
         std::to_string(all_.taken[index(what)]) + " of them taken; a user may have " +
         (percent_ == kDefaultPercent
              ? std::string("no more than is left for the others")
              : "at most " + std::to_string(percent_) + ":" + std::to_string(100 - percent_) +
                    " of what is left for the others") +
         " (arbiterd --user-share): " + name.to_do;
}

}  // namespace arbiter::service
