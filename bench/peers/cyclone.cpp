#include "bench/peers/cyclone.hpp"

#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"
#include "dds_sample.h"

namespace arbiter::bench {
namespace {

class CycloneEndpoint : public Endpoint {
 public:
  CycloneEndpoint(const Exchange& exchange, Side side)
      : exchange_(exchange),
        payload_(exchange.bytes - sizeof(std::uint64_t)),
        initiates_(side == Side::kInitiator),
        out_topic_(participant_.topic(exchange.unique + (initiates_ ? "_ping" : "_pong"))),
        in_topic_(participant_.topic(exchange.unique + (initiates_ ? "_pong" : "_ping"))),
        writer_(participant_.writer(out_topic_)),
        reader_(participant_.reader(in_topic_)),
        waitset_(dds_create_waitset(DDS_CYCLONEDDS_HANDLE), "dds_create_waitset") {
    sample_.payload._buffer = payload_.data();
    sample_.payload._length = sample_.payload._maximum =
        static_cast<std::uint32_t>(payload_.size());
    dds_set_status_mask(reader_.get(), DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(waitset_.get(), reader_.get(), 0);
    await_readers(writer_, 1);
    await_writers(reader_, 1);
  }

  void send(std::uint64_t number) override {
    sample_.number = number;
    const dds_return_t result = dds_write(writer_.get(), &sample_);
    if (result != 0) throw BenchError(std::string("dds_write: ") + dds_strretcode(-result));
  }

  std::uint64_t receive() override {
    std::uint64_t number = 0;
    if (exchange_.waiting == Waiting::kSpinning) {
      spin_until([&] { return take(number); });
      return number;
    }
    while (!take(number)) {
      if (dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_SECS(10)) == 0) {
        throw BenchError("no sample has come for ten seconds");
      }
    }
    return number;
  }

 private:
  bool take(std::uint64_t& number) {
    void* sample = nullptr;  // on loan from the reader
    dds_sample_info_t info;
    const dds_return_t taken = dds_take(reader_.get(), &sample, &info, 1, 1);
    if (taken < 0) throw BenchError(std::string("dds_take: ") + dds_strretcode(-taken));
    if (taken == 0) return false;
    const bool is_sample = info.valid_data;
    number = static_cast<const arbiter_bench_DdsSample*>(sample)->number;
    dds_return_loan(reader_.get(), &sample, taken);
    return is_sample;
  }

  Exchange exchange_;
  std::vector<std::uint8_t> payload_;
  arbiter_bench_DdsSample sample_{};
  bool initiates_;
  DdsParticipant participant_;
  DdsEntity out_topic_;
  DdsEntity in_topic_;
  DdsEntity writer_;
  DdsEntity reader_;
  DdsEntity waitset_;
};

class CycloneSession : public Session {
 public:
  explicit CycloneSession(const Exchange& exchange) : exchange_(exchange) {}
  std::unique_ptr<Endpoint> open(Side side) override {
    return std::make_unique<CycloneEndpoint>(exchange_, side);
  }

 private:
  Exchange exchange_;
};

class CycloneSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return kCyclone; }
  [[nodiscard]] Role role() const override { return Role::kPeer; }
  [[nodiscard]] bool can(const Exchange&) const override { return true; }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<CycloneSession>(exchange);
  }
};

}  // namespace

std::unique_ptr<System> cyclone_system() { return std::make_unique<CycloneSystem>(); }

}  // namespace arbiter::bench
