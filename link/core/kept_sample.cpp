#include "link/core/kept_sample.hpp"

#include <new>

namespace arbiter::link {

void KeptSample::keep(const std::vector<NamedToken>& tokens, Bytes sample) noexcept {
  is_there_ = false;
  try {
    tokens_ = tokens;
    sample_.assign(sample.begin(), sample.end());
    is_there_ = true;
  } catch (const std::bad_alloc&) {
    end();
  }
}

void KeptSample::drop() noexcept { is_there_ = false; }

void KeptSample::end() noexcept {
  is_there_ = false;
  std::vector<NamedToken>().swap(tokens_);
  std::vector<std::byte>().swap(sample_);  // an assignment of nothing would keep the memory
}

}  // namespace arbiter::link
