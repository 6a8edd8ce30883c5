// Exclusive ownership: the reader obeys the strongest of the writers that are alive.
#include <array>

#include "bench/harness/worker.hpp"
#include "bench/peers/contest.hpp"
#include "bench/peers/cyclone.hpp"
#include "dds_sample.h"

namespace arbiter::bench {
namespace {

// Strengths: the override's is the greater.
DdsOptions options(const Contest& contest, Party party) {
  return {static_cast<std::int32_t>(party) + 1, contest.falls_silent ? contest.timeout_ns : 0};
}

class CycloneSources : public Sources {
 public:
  explicit CycloneSources(const Contest& contest)
      : topic_(participant_.topic(contest.unique)),
        writers_{participant_.writer(topic_, options(contest, Party::kOld)),
                 participant_.writer(topic_, options(contest, Party::kOverride))} {
    sample_.payload._buffer = payload_.data();
    sample_.payload._length = sample_.payload._maximum = kPayload;
    for (const DdsEntity& each : writers_) await_readers(each, 1);
  }

  void publish(Party party, std::uint64_t number) override {
    sample_.source = static_cast<std::uint8_t>(party);
    sample_.number = number;
    check(dds_write(writer(party), &sample_), "dds_write");
  }
  // Else the ownership would stay for as long as the writer lives.
  void release() override {
    check(dds_unregister_instance(writer(Party::kOverride), &sample_), "dds_unregister_instance");
  }

 private:
  [[nodiscard]] dds_entity_t writer(Party party) const {
    return writers_[static_cast<std::size_t>(party)].get();
  }
  static void check(dds_return_t result, const char* what) {
    if (result < 0) throw BenchError(std::string(what) + ": " + dds_strretcode(-result));
  }

  static constexpr std::uint32_t kPayload = 48;  // 64 bytes with what is before it
  std::array<std::uint8_t, kPayload> payload_{};
  arbiter_bench_DdsSample sample_{};
  DdsParticipant participant_;
  DdsEntity topic_;
  std::array<DdsEntity, 2> writers_;
};

class CycloneDestination : public Destination {
 public:
  explicit CycloneDestination(const Contest& contest)
      : topic_(participant_.topic(contest.unique)),
        reader_(participant_.reader(topic_, options(contest, Party::kOld))),
        waitset_(dds_create_waitset(DDS_CYCLONEDDS_HANDLE), "dds_create_waitset") {
    dds_set_status_mask(reader_.get(), DDS_DATA_AVAILABLE_STATUS | DDS_LIVELINESS_CHANGED_STATUS);
    dds_waitset_attach(waitset_.get(), reader_.get(), 0);
    await_writers(reader_, 2);
  }

  Taken take() override {
    void* sample = nullptr;
    dds_sample_info_t info;
    const dds_return_t count = dds_take(reader_.get(), &sample, &info, 1, 1);
    if (count < 0) throw BenchError(std::string("dds_take: ") + dds_strretcode(-count));
    if (count == 0) return {};
    const auto& data = *static_cast<const arbiter_bench_DdsSample*>(sample);
    const Taken result =
        info.valid_data ? Taken{Taken::Kind::kSample, static_cast<Party>(data.source), data.number}
                        : Taken{};
    dds_return_loan(reader_.get(), &sample, count);
    return result;
  }

  Taken wait() override {
    for (;;) {
      if (const Taken result = take(); result.kind != Taken::Kind::kNothing) return result;
      dds_liveliness_changed_status_t liveliness{};
      dds_get_liveliness_changed_status(reader_.get(), &liveliness);
      if (liveliness.alive_count_change != 0 && liveliness.alive_count == 0) {
        return {Taken::Kind::kIdle};
      }
      if (dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_SECS(1)) == 0) return {};
    }
  }

 private:
  DdsParticipant participant_;
  DdsEntity topic_;
  DdsEntity reader_;
  DdsEntity waitset_;
};

class CycloneContest : public ContestSession {
 public:
  explicit CycloneContest(const Contest& contest) : contest_(contest) {}

  std::unique_ptr<Sources> open_sources() override {
    return std::make_unique<CycloneSources>(contest_);
  }
  std::unique_ptr<Destination> open_destination() override {
    return std::make_unique<CycloneDestination>(contest_);
  }

 private:
  Contest contest_;
};

}  // namespace

std::unique_ptr<ContestSession> cyclone_contest(const Contest& contest) {
  return std::make_unique<CycloneContest>(contest);
}

}  // namespace arbiter::bench
