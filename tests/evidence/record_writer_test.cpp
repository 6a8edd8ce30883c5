// What a file has no room for.
#include "evidence/record_writer.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "evidence/record_reader.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

// A hostile publisher opens its port again and again, each time with another type.
TEST(Records, LeaveOutPayloadsForWhichTheFileHasNoChannel) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("many.mcap");
  constexpr std::uint64_t kTypes = 80;  // with names of a mebibyte
  std::vector<std::string> said;
  evidence::RecordingInfo info;
  info.say = [&](const std::string& text) { said.push_back(text); };
  evidence::RecordWriter writer(path, {}, info);
  evidence::Arrival arrival;
  arrival.is_sample = true;
  for (std::uint64_t i = 1; i <= kTypes + 1; ++i) {
    evidence::SourceContext context;
    context.source = "/low";
    context.type = std::to_string(i > kTypes ? 1 : i);  // the last one is known
    context.type.resize(std::size_t{1} << 20, 'x');
    arrival.context = std::make_shared<const evidence::SourceContext>(context);
    arrival.time = arrival.seen = static_cast<shm::Nanoseconds>(i);
    arrival.sequence = i;
    arrival.payload.emplace(1);
    writer.write(arrival);
  }
  writer.close();
  std::uint64_t missed = 0;
  std::uint64_t payloads = 0;
  std::uint64_t arrivals = 0;
  bool has_last = false;
  evidence::read_recording(path, evidence::Payloads::read, [&](evidence::Record&& record) {
    if (const auto* each = std::get_if<evidence::Missed>(&record)) {
      EXPECT_EQ(each->why, evidence::Missed::Why::too_large);
      missed += each->samples;
    } else if (const auto* one = std::get_if<evidence::Arrival>(&record)) {
      ++arrivals;
      payloads += one->payload ? 1 : 0;
      has_last = one->payload.has_value();
      EXPECT_EQ(one->payload.has_value(), one->has_payload);
    }
  });
  EXPECT_EQ(arrivals, kTypes + 1);
  EXPECT_EQ(missed + payloads, arrivals);
  EXPECT_GT(missed, 0u);
  EXPECT_TRUE(has_last);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("of /low are left out"), std::string::npos) << said[0];
}

}  // namespace
}  // namespace arbiter::test
