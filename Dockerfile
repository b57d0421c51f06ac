# One image for every process of the bench; docker-compose.yml says which command each container runs.
FROM python:3.11-slim

# numba and the CAN and serial libraries come as wheels: no compiler is needed here.
RUN useradd --create-home bench && mkdir /data && chown bench /data
WORKDIR /opt/mrbench
# A machine without a GPU saves gigabytes with PyTorch's CPU index: --build-arg PIP_EXTRA_INDEX_URL=...
ARG PIP_EXTRA_INDEX_URL=
# Dependencies first: an edit of the sources does not load them again.
COPY pyproject.toml README.md ./
RUN pip install --no-cache-dir '.[identification,sim,export,postgres,s3]'
COPY bench bench
COPY drivers drivers
COPY identification identification
COPY sim_rig sim_rig
RUN pip install --no-cache-dir --no-deps --force-reinstall .

USER bench
ENV MRBENCH_CACHE=/data/cache
# Of the rig agent; in the volume, because agent and service share nothing else.
ENV MRBENCH_SOCKETS=/data/sockets
VOLUME /data
WORKDIR /data
ENTRYPOINT ["mrbench"]
CMD ["--help"]
