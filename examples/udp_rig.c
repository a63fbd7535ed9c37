/* A rig in a process of its own, in C: one UDP packet each way per tick.

   Try it:    cc -O2 -ffp-contract=off -o udp_rig examples/udp_rig.c -lm
              ./udp_rig 127.0.0.1 9100        and, in a second terminal,    rths run examples/udp_rig.toml --virtual

   rig_arm, rig_read, rig_write and rig_stop are the rig: an actuator that lags by 11 ms and a column of 12.5 kN/mm, the
   same as examples/udp_rig.py. Replace them by functions that move your hardware. docs/reference/udp-rig.md has the
   layout of the packets. Numbers are read and written byte by byte, so that the byte order of the machine does not
   matter. */

#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { SIZE = 128, CHECKED = 124, COMMANDS = 1, MEASURED = 2 };
enum { ECHO = 1, ARM, COMMAND, DISARM };                          /* kinds of packets */
enum { IDLE, PREPARING, READY, RUNNING, STOPPED, EMERGENCY };     /* states of the rig */
static const char *CHANNELS = "actuator_command m;column_displacement m;column_force N";

/* ---- the rig ------------------------------------------------------------------------------------------------- */

static double part, position, command;

static const char *rig_arm(double interval, uint64_t seed)        /* NULL, or the reason why it cannot be */
{
    (void)seed;
    part = 1.0 - exp(-interval / 8.0 / 0.011);
    position = command = 0.0;
    return NULL;
}

static void rig_read(double *measured)                            /* deformation (m) and force (N) now */
{
    measured[0] = position;
    measured[1] = 12.5e6 * position;
}

static void rig_write(const double *values)                       /* ramp to the command over the coming interval; */
{                                                                 /* hardware returns when that interval is over */
    double start = command;
    command = values[0];
    for (int i = 1; i <= 8; i++)
        position += part * (start + (command - start) * i / 8.0 - position);
}

static void rig_stop(void) {}                                     /* stop safely */

/* ---- packets ------------------------------------------------------------------------------------------------- */

static uint32_t crc32(const unsigned char *bytes, size_t count)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
    return ~crc;
}

static uint64_t get(const unsigned char *bytes, int count)
{
    uint64_t value = 0;
    while (count--)
        value = value << 8 | bytes[count];
    return value;
}

static void put(unsigned char *bytes, int count, uint64_t value)
{
    for (int i = 0; i < count; i++, value >>= 8)
        bytes[i] = value & 0xff;
}

static double get_double(const unsigned char *bytes)
{
    uint64_t bits = get(bytes, 8);
    double value;
    memcpy(&value, &bits, 8);
    return value;
}

static void put_double(unsigned char *bytes, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, 8);
    put(bytes, 8, bits);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

static int state = IDLE;
static const char *text = "";
static uint32_t session, seq;
static double silence, heard;
static unsigned char last[SIZE];                                  /* answer to the last packet other than an echo */

static void fill(unsigned char *answer, int kind, uint32_t of, uint32_t number, int said, const char *why, int measured)
{
    double values[MEASURED];
    memset(answer, 0, SIZE);
    memcpy(answer, "RTHA", 4);
    put(answer + 4, 2, 1);
    put(answer + 6, 2, kind);
    put(answer + 8, 4, of);
    put(answer + 12, 4, number);
    put(answer + 16, 4, crc32((const unsigned char *)CHANNELS, strlen(CHANNELS)));
    put(answer + 20, 2, said);
    put(answer + 22, 2, measured ? MEASURED : 0);
    if (measured) {
        rig_read(values);
        for (int i = 0; i < MEASURED; i++)
            put_double(answer + 24 + 8 * i, values[i]);
    }
    strncpy((char *)answer + 88, why, 36);
    put(answer + CHECKED, 4, crc32(answer, CHECKED));
}

static int answer_to(const unsigned char *packet, ssize_t size, unsigned char *answer)
{
    if (size != SIZE || crc32(packet, CHECKED) != get(packet + CHECKED, 4) || memcmp(packet, "RTHR", 4))
        return 0;
    int kind = get(packet + 6, 2);
    uint32_t of = get(packet + 8, 4), number = get(packet + 12, 4);
    if (get(packet + 4, 2) != 1)
        return 0;
    if (kind == ECHO) {                                           /* answer with the readings of real sensors here */
        fill(answer, kind, of, number, state, text, 0);
        return 1;
    }
    if (kind == ARM && of != session && state != READY && state != RUNNING) {
        session = of;
        seq = 0;
        silence = get_double(packet + 24);
    }
    if (of != session) {
        if (kind == ARM)
            fill(answer, kind, of, number, IDLE, "busy with another test", 0);
        return kind == ARM;
    }
    heard = now();
    if (number == seq)                                            /* a packet that is sent twice is answered twice */
        memcpy(answer, last, SIZE);
    if (number <= seq)
        return number == seq;
    seq = number;
    if (get(packet + 44, 4) != crc32((const unsigned char *)CHANNELS, strlen(CHANNELS))) {
        state = STOPPED;
        text = "other channels than in the plan";
    } else if (kind == ARM) {
        text = rig_arm(get_double(packet + 16), get(packet + 32, 8));
        state = text ? STOPPED : READY;
        text = text ? text : "";
    } else if (kind == COMMAND && (state == READY || state == RUNNING)) {
        double values[COMMANDS];
        for (int i = 0; i < COMMANDS; i++)
            values[i] = get_double(packet + 48 + 8 * i);
        rig_write(values);
        state = RUNNING;
    } else if (kind == DISARM) {
        rig_stop();
        state = IDLE;
    }
    fill(last, kind, of, number, state, text, kind != DISARM);
    memcpy(answer, last, SIZE);
    return 1;
}

int main(int count, char **words)
{
    struct sockaddr_in here = {.sin_family = AF_INET}, whence;
    unsigned char packet[SIZE + 1], answer[SIZE];
    here.sin_port = htons(count > 2 ? atoi(words[2]) : 9100);
    if (inet_pton(AF_INET, count > 1 ? words[1] : "127.0.0.1", &here.sin_addr) != 1)
        return fprintf(stderr, "usage: udp_rig [IPV4 [PORT]]\n"), 2;
    int place = socket(AF_INET, SOCK_DGRAM, 0);
    if (bind(place, (struct sockaddr *)&here, sizeof here))
        return perror("udp_rig: the port cannot be used"), 1;
    for (;;) {
        struct pollfd one = {.fd = place, .events = POLLIN};
        if (poll(&one, 1, 5) > 0) {
            socklen_t length = sizeof whence;
            ssize_t size = recvfrom(place, packet, sizeof packet, 0, (struct sockaddr *)&whence, &length);
            if (answer_to(packet, size, answer))
                sendto(place, answer, SIZE, 0, (struct sockaddr *)&whence, length);
        }
        if (state == RUNNING && now() - heard > silence) {
            state = STOPPED;
            text = "no packet for too long";
            rig_stop();
        }
    }
}
