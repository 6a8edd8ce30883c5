// What a file has no room for.
#include "evidence/record_writer.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "evidence/record_reader.hpp"
#include "tests/evidence/incident.hpp"
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

std::vector<evidence::Record> records_in(const std::string& file) {
  std::vector<evidence::Record> records;
  evidence::read_recording(file, evidence::Payloads::read, [&](evidence::Record&& record) {
    records.push_back(std::move(record));
  });
  return records;
}

// What a publisher or another host has told is written as it is.
TEST(Records, HaveNumbersOfAnySize) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  Incident incident;
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  evidence::Record record = incident.records().back();
  auto& arrival = std::get<evidence::Arrival>(record);
  arrival.sequence = arrival.size = arrival.generation = kMost;
  arrival.origin = {kMost, kMost};
  incident.add(record);
  incident.state("/high", 1030, 1031, shm::kNeverActive, evidence::SourceState::Why::gap, kMost);
  const auto records = records_in(incident.file());
  ASSERT_EQ(records.size(), incident.records().size());
  const auto& read = std::get<evidence::Arrival>(records.end()[-2]);
  for (const std::uint64_t number :
       {read.sequence, read.size, read.generation, read.origin.publisher, read.origin.sequence,
        std::get<evidence::SourceState>(records.back()).lost}) {
    EXPECT_EQ(number, kMost);
  }
}

// A daemon takes files of 16 MiB, and JSON makes some of their bytes long.
TEST(Records, OfModelsLackTextsThatAreTooLarge) {
  constexpr std::size_t kBytes = 11'500'000;  // times six are more than a record has
  std::vector<std::string> said;
  evidence::RecordingInfo info;
  info.say = [&](const std::string& text) { said.push_back(text); };
  const TemporaryDirectory directory;
  evidence::RecordWriter writer(directory.file("new.mcap"), {}, info);
  writer.write(evidence::Start{1'000, "test", {}, "none"});
  evidence::ModelChange model;
  model.time = model.seen = 900;
  model.generation = 7;
  model.name = "calm";
  model.how = "load";
  model.by = "me";
  model.has_texts = true;
  model.files = {{"lines.xml", std::string(kBytes, '\n')}};
  writer.write(model);
  EXPECT_TRUE(said.empty());
  model.files = {{"tabs.xml", std::string(kBytes, '\t')}};
  model.application = evidence::ModelFile{"app.xml", "<application/>"};
  writer.write(model);
  EXPECT_EQ(said, (std::vector<std::string>{"the texts of model 7 are too large for a "
                                            "recording: its decisions cannot be taken again"}));
  writer.close();
  const auto records = records_in(directory.file("new.mcap"));
  ASSERT_EQ(records.size(), 3u);
  EXPECT_EQ(std::get<evidence::ModelChange>(records[1]).files.at(0).text.size(), kBytes);
  const auto& second = std::get<evidence::ModelChange>(records[2]);
  EXPECT_FALSE(second.has_texts);
  EXPECT_TRUE(second.files.empty() && !second.application);
  EXPECT_EQ(std::tie(second.time, second.generation, second.name, second.how, second.by),
            std::tie(model.time, model.generation, model.name, model.how, model.by));
}

}  // namespace
}  // namespace arbiter::test
