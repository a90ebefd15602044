# simgl on the CPU, or on a GPU with the NVIDIA runtime; docs/howto/container.md says how to use it.
FROM python:3.12-slim AS wheel
COPY . /source
RUN pip wheel --no-deps --wheel-dir /wheels /source

FROM python:3.12-slim
# What ./run installs besides Python itself.
RUN apt-get update \
    && apt-get install -y --no-install-recommends ca-certificates libegl1 libgl1 \
    && rm -rf /var/lib/apt/lists/*
COPY --from=wheel /wheels /wheels
COPY constraints.txt /wheels/
RUN pip install --no-cache-dir -c /wheels/constraints.txt /wheels/*.whl && rm -r /wheels
# Threads of Mesa's CPU renderer crash a process in rare cases.
ENV LP_NUM_THREADS=0 XDG_CACHE_HOME=/cache
RUN useradd --create-home simgl && mkdir /cache /work && chown simgl /cache /work
USER simgl
VOLUME /cache
WORKDIR /work
ENTRYPOINT ["simgl"]
