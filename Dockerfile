# One image for every process of the bench; docker-compose.yml says which command each container runs.
FROM python:3.11-slim

# numba and the CAN and serial libraries come as wheels: no compiler is needed here.
RUN useradd --create-home bench && mkdir /data && chown bench /data
WORKDIR /opt/mrbench
COPY pyproject.toml README.md ./
COPY bench bench
COPY drivers drivers
COPY identification identification
COPY sim_rig sim_rig
# A machine without a GPU saves gigabytes with PyTorch's CPU index: --build-arg PIP_EXTRA_INDEX_URL=...
ARG PIP_EXTRA_INDEX_URL=
RUN pip install --no-cache-dir '.[identification,sim,export]'

USER bench
ENV MRBENCH_CACHE=/data/cache
VOLUME /data
WORKDIR /data
ENTRYPOINT ["mrbench"]
CMD ["--help"]
