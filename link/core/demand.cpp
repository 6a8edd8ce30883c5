#include "link/core/demand.hpp"

namespace arbiter::link {

void ImportDemand::begin(SourceUse use, shm::Nanoseconds now) noexcept {
  use_ = use;
  asked_ = now;
  loses_ = false;
  const bool has_port = use == SourceUse::kForever || use == SourceUse::kFinite;
  demand_ = has_port ? Demand::kSamples : Demand::kHeaders;
}

void ImportDemand::set_use(SourceUse use, shm::Nanoseconds now) noexcept {
  if (use != use_) begin(use, now);
}

void ImportDemand::note_arrival(bool wants_samples, shm::Nanoseconds now) noexcept {
  if (wants_samples) {
    if (demand_ != Demand::kSamples) asked_ = now;
    loses_ = false;
    demand_ = Demand::kSamples;
    return;
  }
  if (!loses_) loses_since_ = now;
  loses_ = true;
  if (use_ == SourceUse::kSensed || use_ == SourceUse::kNone) {
    demand_ = Demand::kHeaders;
  } else if (use_ == SourceUse::kFinite && now - loses_since_ >= kLosesFor) {
    demand_ = Demand::kSmallSamples;
  }
}

}  // namespace arbiter::link
