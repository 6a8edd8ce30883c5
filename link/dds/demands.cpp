#include "link/dds/demands.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <new>
#include <optional>
#include <utility>

namespace arbiter::link {
namespace {

// A bound of what is looked at for one writer: where there are more readers, all samples are sent.
constexpr std::size_t kMaxReaders = 64;

// What could not be said is said again after it: memory is short.
constexpr std::chrono::milliseconds kTellAgain{100};

struct FreeReader {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const {
    dds_builtintopic_free_endpoint(endpoint);
  }
};

Demand demand_of(dds_entity_t writer, dds_instance_handle_t reader) {
  const std::unique_ptr<dds_builtintopic_endpoint_t, FreeReader> endpoint(
      dds_get_matched_subscription_data(writer, reader));
  if (endpoint == nullptr || endpoint->qos == nullptr) return Demand::kSamples;
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint->qos, &data, &size) || data == nullptr) return Demand::kSamples;
  const auto card = read_demand_card(Bytes(static_cast<const std::byte*>(data), size));
  dds_free(data);
  return card ? card->demand : Demand::kSamples;
}

}  // namespace

DemandTeller::DemandTeller(Set set) : set_(std::move(set)), thread_([this] { run(); }) {}

DemandTeller::~DemandTeller() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

bool DemandTeller::tell(dds_entity_t reader, const DemandCard& card) noexcept {
  try {
    const std::lock_guard lock(mutex_);
    untold_[reader] = card;
  } catch (const std::bad_alloc&) {
    return false;
  }
  changed_.notify_one();
  return true;
}

dds_return_t DemandTeller::set_user_data(dds_entity_t reader, const ByteString& data) {
  const gateway::dds::CycloneQos qos(dds_create_qos());
  dds_qset_userdata(qos.get(), data.data(), data.size());
  return dds_set_qos(reader, qos.get());
}

void DemandTeller::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ends_ || !untold_.empty(); });
    if (ends_) return;
    auto next = untold_.extract(untold_.begin());
    lock.unlock();
    const bool is_said = say(next.key(), next.mapped());
    lock.lock();
    if (is_said) continue;
    untold_.insert(std::move(next));  // unless there is a newer word
    changed_.wait_for(lock, kTellAgain, [&] { return ends_; });
  }
}

bool DemandTeller::say(dds_entity_t reader, const DemandCard& card) const noexcept {
  try {
    const dds_return_t set = set_(reader, write_demand_card(card));
    // The reader is gone.
    return set == DDS_RETCODE_OK || set == DDS_RETCODE_BAD_PARAMETER ||
           set == DDS_RETCODE_ALREADY_DELETED;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

EndWatch::EndWatch(const Network& network, Ends ends, const gateway::Bell& bell) {
  // Cyclone has one pointer for what a listener is given, and does not write through it.
  const gateway::dds::Listener listener(dds_create_listener(const_cast<gateway::Bell*>(&bell)));
  dds_lset_data_available(listener.get(), [](dds_entity_t /*reader*/, void* rings) {
    static_cast<const gateway::Bell*>(rings)->ring();
  });
  const dds_entity_t topic = ends == Ends::kReaders ? DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION
                                                    : DDS_BUILTIN_TOPIC_DCPSPUBLICATION;
  ends_ = Entity(dds_create_reader(network.participant(), topic, nullptr, listener.get()),
                 "the reader of readers and writers");
}

std::vector<std::string> EndWatch::changed() {
  constexpr std::size_t kBatch = 32;
  std::vector<std::string> topics;
  for (;;) {
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t taken = dds_take(ends_.get(), samples.data(), infos.data(), kBatch, kBatch);
    if (taken <= 0) break;
    for (std::size_t i = 0; i < static_cast<std::size_t>(taken); ++i) {
      if (!infos[i].valid_data) continue;
      const auto& end = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      if (end.topic_name != nullptr) topics.emplace_back(end.topic_name);
    }
    dds_return_loan(ends_.get(), samples.data(), taken);
  }
  std::sort(topics.begin(), topics.end());
  topics.erase(std::unique(topics.begin(), topics.end()), topics.end());
  return topics;
}

Demand demand_of_readers(dds_entity_t writer) {
  std::array<dds_instance_handle_t, kMaxReaders> readers{};
  const dds_return_t found = dds_get_matched_subscriptions(writer, readers.data(), readers.size());
  if (found <= 0 || static_cast<std::size_t>(found) > readers.size()) return Demand::kSamples;
  Demand most = Demand::kHeaders;
  for (std::size_t i = 0; i < static_cast<std::size_t>(found); ++i) {
    most = std::min(most, demand_of(writer, readers.at(i)));
    if (most == Demand::kSamples) break;
  }
  return most;
}

}  // namespace arbiter::link
