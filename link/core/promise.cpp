#include "link/core/promise.hpp"

#include <algorithm>

namespace arbiter::link {

Promise::Verdict Promise::judge(const SwitchAttempt& attempt, shm::Nanoseconds now) {
  let_expire(now);
  if (promised_) return promised_->to == attempt ? Verdict::kFree : Verdict::kBusy;
  const auto debt = debts_.find(attempt.asker);
  const bool is_free = debt == debts_.end() || rest_of(debt->second, now) < kHolds;
  return is_free ? Verdict::kFree : Verdict::kTooMuch;
}

void Promise::promise(const SwitchAttempt& attempt, const std::string& model,
                      shm::Nanoseconds now) {
  // Asked again, it holds no longer than if it had been asked once.
  if (promised_ && promised_->to == attempt) return;
  promised_ = Promised{attempt, model, now};
}

std::optional<std::string> Promise::keep(const SwitchAttempt& attempt, shm::Nanoseconds now) {
  let_expire(now);
  if (!promised_ || promised_->to != attempt) return std::nullopt;
  std::string model = std::move(promised_->model);
  promised_.reset();
  return model;
}

void Promise::release(const SwitchAttempt& attempt, shm::Nanoseconds now) {
  let_expire(now);
  if (!promised_ || promised_->to != attempt) return;
  charge(attempt.asker, now - promised_->since, now);
  promised_.reset();
}

bool Promise::is_promised(shm::Nanoseconds now) {
  let_expire(now);
  return promised_.has_value();
}

void Promise::let_expire(shm::Nanoseconds now) {
  if (!promised_ || now - promised_->since < kHolds) return;
  charge(promised_->to.asker, kHolds, promised_->since + kHolds);
  promised_.reset();
}

void Promise::charge(Incarnation asker, shm::Nanoseconds held, shm::Nanoseconds now) {
  std::erase_if(debts_, [now](const auto& each) { return rest_of(each.second, now) == 0; });
  if (debts_.size() >= kMostAskers && !debts_.contains(asker)) {
    debts_.erase(
        std::min_element(debts_.begin(), debts_.end(), [now](const auto& a, const auto& b) {
          return rest_of(a.second, now) < rest_of(b.second, now);
        }));
  }
  Debt& debt = debts_[asker];
  debt = {rest_of(debt, now) + held, now};
}

// kHolds are forgotten within kWithin.
shm::Nanoseconds Promise::rest_of(const Debt& debt, shm::Nanoseconds now) {
  const shm::Nanoseconds forgotten = (now - debt.as_of) / (kWithin / kHolds);
  return std::max<shm::Nanoseconds>(0, debt.amount - forgotten);
}

}  // namespace arbiter::link
