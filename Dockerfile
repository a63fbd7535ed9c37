# One image for master, slave and recorder.
# BASE_IMAGE: an image of a Debian-like system with Python 3.11 and its venv module.
ARG BASE_IMAGE=python:3.11-slim

FROM ${BASE_IMAGE} AS packages
# The folder wheels/ is optional: it holds the locked packages where the build has no network.
COPY requirements.lock wheel[s] /tmp/locked/
RUN set -eu; \
    python3 -m venv /opt/venv; \
    if ls /tmp/locked/*.whl > /dev/null 2>&1; then set -- --no-index --find-links /tmp/locked; fi; \
    /opt/venv/bin/pip install --no-cache-dir --require-hashes --only-binary :all: "$@" -r /tmp/locked/requirements.lock

FROM ${BASE_IMAGE}
ENV PATH=/opt/venv/bin:$PATH PYTHONUNBUFFERED=1 XDG_CACHE_HOME=/var/cache/rths MPLCONFIGDIR=/tmp/matplotlib
RUN useradd --uid 1000 --user-group --create-home rths && \
    install -d -o rths -g rths /runs && \
    install -d -m 1777 /var/cache/rths
COPY --from=packages /opt/venv /opt/venv
WORKDIR /opt/rths
COPY pyproject.toml README.md ./
COPY common common
COPY models models
COPY laboratories laboratories
COPY loop loop
COPY master master
COPY slave slave
COPY recorder recorder
COPY diagnosis diagnosis
COPY simulation simulation
COPY report report
COPY validation validation
COPY rths rths
COPY examples examples
# A plan's folder for recordings is `runs` unless it says otherwise: the one that is mounted.
RUN pip install --no-cache-dir --no-index --no-deps --no-build-isolation -e . && ln -s /runs runs && \
    python -m simulation.warm && chmod -R a+rwX /var/cache/rths
USER rths
CMD ["rths", "--help"]
