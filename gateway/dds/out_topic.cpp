#include "gateway/dds/out_topic.hpp"

#include <cstring>
#include <string>
#include <utility>

#include "gateway/dds/opaque_type.hpp"
#include "gateway/mapping/encapsulation.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway::dds {

namespace {

// Null: no memory; then nothing is kept, rather than what was sent before.
LastSample keep_unsent(Bytes sample) noexcept {
  Payload* const copy = draft_payload(sample.size());
  if (copy == nullptr) return nullptr;
  std::memcpy(copy->bytes(), sample.data(), sample.size());
  copy->cyclone.ops = nullptr;
  return LastSample(copy);
}

bool is_unsent(const Payload& payload) noexcept { return payload.cyclone.ops == nullptr; }

}  // namespace

OutTopic::OutTopic(const Entry& entry, Account& account, const Bell& bell)
    : EndPoint(End::kWriter, entry, account),
      bell_(bell),
      representation_(offered_representation(entry.dds->qos)),
      has_idle_sample_(entry.idle.kind != Idle::Kind::kNothing) {}

bool OutTopic::latches() const {
  return entry().dds->qos.durability == Durability::kTransientLocal;
}

LastSample OutTopic::take_last() noexcept { return has_idle_sample_ ? nullptr : std::move(last_); }

// A copy: the last one is of the end before, or was not made for one.
void OutTopic::begin() noexcept {
  if (!last_) return;
  Payload* const again = make_payload(type_, {last_->bytes(), last_->size});
  if (again != nullptr) static_cast<void>(write(*again));  // else catch_up()
}

void OutTopic::catch_up() noexcept {
  const std::lock_guard lock(in_use());
  if (is_open() && last_ && is_unsent(*last_)) begin();
}

void OutTopic::keep_untold(Bytes sample) noexcept {
  if (latches()) last_ = has_idle_sample_ ? nullptr : keep_unsent(sample);
}

Entity OutTopic::make(dds_entity_t participant, dds_entity_t topic, const ddsi_sertype* type,
                      const dds_qos_t* qos) {
  type_ = type;
  readers_.store(0, std::memory_order_relaxed);
  const Listener listener(dds_create_listener(this));
  dds_lset_publication_matched(
      listener.get(), [](dds_entity_t /*writer*/, const dds_publication_matched_status_t status,
                         void* self) { static_cast<OutTopic*>(self)->on_matched(status); });
  return {dds_create_writer(participant, topic, qos, listener.get()),
          "a writer of " + this->topic().name};
}

std::uint32_t OutTopic::matched() const {
  dds_publication_matched_status_t status{};
  if (dds_get_publication_matched_status(end().get(), &status) < 0) return 0;
  return status.current_count;
}

// A reader that comes while nobody commands is to be told so at once.
void OutTopic::on_matched(const dds_publication_matched_status_t& status) noexcept {
  readers_.store(status.current_count, std::memory_order_relaxed);
  if (Outgoing* const outgoing = outgoing_.get();
      outgoing != nullptr && status.current_count_change > 0) {
    outgoing->peer_matched();
  }
  bell_.ring();  // who has gone is to be told, too
}

bool OutTopic::may_wait() noexcept {
  const std::lock_guard lock(in_use());
  return !has_waited_in_vain_;
}

Sender::Result OutTopic::send(Bytes sample) noexcept {
  Result result = send_at_once(sample);
  if (result != Result::kBusy) return result;
  if (may_wait()) {
    // Cyclone has asked for acknowledgements.
    dds_wait_for_acks(end().get(), kMaxBlocking);
    result = send_at_once(sample);
    if (result != Result::kBusy) return result;
  }
  {
    const std::lock_guard lock(in_use());
    has_waited_in_vain_ = true;
    keep_untold(sample);
  }
  return refuse("a subscriber does not keep up: a sample was not sent, the writer was full");
}

// On a thread of Cyclone's that delivers a sample, perhaps the one that receives acknowledgements:
// so the writer's own time to wait is none.
Sender::Result OutTopic::send_at_once(Bytes sample) noexcept {
  const std::lock_guard lock(in_use());
  if (const auto result = obstacle(sample)) return *result;
  Payload* const draft = draft_payload(sample.size());
  if (draft == nullptr) return Result::kNoMemory;
  std::memcpy(draft->bytes(), sample.data(), sample.size());
  begin_payload(*draft, type_);
  return write(*draft);
}

WritableBytes OutTopic::draft(std::size_t bytes) noexcept {
  draft_ = draft_payload(bytes);
  if (draft_ == nullptr) return {};
  return {draft_->bytes(), bytes};
}

Sender::Result OutTopic::send_draft() noexcept {
  const std::lock_guard lock(in_use());
  if (const auto result = obstacle({draft_->bytes(), draft_->size})) {
    drop_draft();
    return *result;
  }
  begin_payload(*draft_, type_);
  ddsi_serdata_ref(&draft_->cyclone);  // Cyclone gives up one that it cannot send at once
  is_draft_begun_ = true;
  const Result result = write(*draft_);
  if (result != Result::kBusy) drop_draft();
  return result;
}

void OutTopic::drop_draft() noexcept {
  Payload* const draft = std::exchange(draft_, nullptr);
  if (std::exchange(is_draft_begun_, false)) {
    ddsi_serdata_unref(&draft->cyclone);
  } else {
    PayloadPool::of_process().give_back(draft);
  }
}

std::optional<Sender::Result> OutTopic::obstacle(Bytes sample) noexcept {
  if (!is_open() && has_idle_sample_) last_.reset();  // the idle sample, or the next one, follows
  const Encapsulation encapsulation = read_encapsulation(sample);
  const bool is_xcdr2 = representation_ == Representation::kXcdr2;
  if (encapsulation.encoding != (is_xcdr2 ? Encoding::kXcdr2 : Encoding::kXcdr1)) {
    return refuse(std::string("a sample does not begin with the encapsulation header of ") +
                  (is_xcdr2 ? "XCDR2" : "XCDR1") +
                  ": who publishes it must send what DDS would (docs/dds.md)");
  }
  const auto& size = topic().size;
  if (size && !may_have(encapsulation, sample.size() - kEncapsulationBytes, *size)) {
    account().set_last_reason(wrong_size(sample.size()));
    return Result::kUnreadable;
  }
  if (is_open()) return {};
  keep_untold(sample);
  return Result::kNotReady;
}

Sender::Result OutTopic::write(Payload& payload) noexcept {
  const std::size_t size = payload.size;
  LastSample sent = latches() ? keep(payload) : nullptr;
  // To send it to nobody takes no time, and says nothing.
  const bool is_measured = size > Pace::kAlways && readers_.load(std::memory_order_relaxed) != 0;
  const shm::Nanoseconds begin = is_measured ? shm::monotonic_now() : 0;
  const dds_return_t written = dds_writecdr(end().get(), &payload.cyclone);
  if (written == DDS_RETCODE_OK) {
    has_waited_in_vain_ = false;
    if (sent) last_ = std::move(sent);
    if (is_measured) pace_.note(size, shm::monotonic_now() - begin);
    return Result::kSent;
  }
  if (written == DDS_RETCODE_TIMEOUT) return Result::kBusy;
  if (sent) keep_untold({sent->bytes(), sent->size});
  return refuse(std::string("Cyclone DDS did not send a sample: ") + dds_strretcode(-written));
}

Sender::Result OutTopic::refuse(const std::string& why) noexcept {
  account().set_last_reason(why);
  return Result::kRefused;
}

}  // namespace arbiter::gateway::dds
