// MPU6050 and two wheel encoders on an ESP32 (or another Arduino board with interrupts): one line
// per sample, every 2 ms, with the board's own microseconds. Read it with serial_node:
//   ros2 run twbr_estimation serial_node --ros-args -p port:=/dev/ttyUSB0 -p baud_rate:=921600 -p description:=columns.yaml
#include <Wire.h>

const int MPU = 0x68, PERIOD_US = 2000;
const int LEFT_A = 18, LEFT_B = 19, RIGHT_A = 25, RIGHT_B = 26;  // the pins of your encoders
volatile long left_count = 0, right_count = 0;

void IRAM_ATTR left_edge() { left_count += digitalRead(LEFT_A) == digitalRead(LEFT_B) ? 1 : -1; }
void IRAM_ATTR right_edge() { right_count += digitalRead(RIGHT_A) == digitalRead(RIGHT_B) ? 1 : -1; }

void set_register(uint8_t name, uint8_t value) {
  Wire.beginTransmission(MPU);
  Wire.write(name);
  Wire.write(value);
  Wire.endTransmission();
}

void setup() {
  Serial.begin(921600);
  Wire.begin();
  Wire.setClock(400000);
  set_register(0x6B, 0x01);  // awake, clock of the gyro
  set_register(0x1A, 0x01);  // low-pass of 188 Hz
  set_register(0x1B, 0x10);  // +-1000 deg/s
  set_register(0x1C, 0x10);  // +-8 g
  for (int pin : {LEFT_A, LEFT_B, RIGHT_A, RIGHT_B}) pinMode(pin, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(LEFT_A), left_edge, CHANGE);
  attachInterrupt(digitalPinToInterrupt(RIGHT_A), right_edge, CHANGE);
}

void loop() {
  static uint32_t due = micros();
  while ((int32_t)(micros() - due) < 0) {}
  due += PERIOD_US;
  Wire.beginTransmission(MPU);
  Wire.write(0x3B);
  if (Wire.endTransmission(false) != 0) return;
  uint32_t time = micros();
  if (Wire.requestFrom(MPU, 14) != 14) return;
  int16_t word[7];  // accelerometer x y z, temperature, gyro x y z
  for (int i = 0; i < 7; i++) word[i] = (Wire.read() << 8) | Wire.read();
  noInterrupts();
  long left = left_count, right = right_count;
  interrupts();
  Serial.printf("%lu,%d,%d,%d,%d,%d,%d,%ld,%ld\n", (unsigned long)time, word[4], word[5], word[6],
                word[0], word[1], word[2], left, right);
}
